"""What a run leaves for its next start: snapshots, checkpoints, cuts, the ledger."""

import contextlib
import functools
import itertools
import json
import sqlite3
from pathlib import Path
from random import Random
from typing import Any

import msgspec
import numpy as np
import torch
from safetensors.numpy import load, save

from services.jobs.train import serial
from services.league import events
from services.league.ledger import Ledger, open_read_only
from services.learner import checkpoint
from shared.bus.delivery import Applied
from shared.errors import CheckpointError, LedgerError, SnapshotError
from shared.policy.snapshot import unpack
from tests.fuzz import formats, mutate, trees, values
from tests.fuzz.target import MIB, Bound, Target, from_file
from tests.unit.policy.making import snapshot

BOUND = Bound(64, 48 * MIB)
HOSTILE_SQL = (
    "DROP TABLE events",
    "DELETE FROM events WHERE seq = 1",
    "INSERT INTO events VALUES (99, 'x', 'y', '{}', 0)",
    "UPDATE events SET body = x'ff00ff'",
    "UPDATE events SET body = 7",
    "UPDATE events SET body = '[' || body",
    "UPDATE events SET kind = 'run_finished'",
    "UPDATE events SET kind = x'00'",
    "UPDATE events SET at_ns = 'later'",
    "UPDATE events SET at_ns = 1e300",
    "PRAGMA user_version = 99",
    "PRAGMA application_id = 1",
    "CREATE TABLE more (x)",
    "CREATE TRIGGER t AFTER INSERT ON events BEGIN DELETE FROM events; END",
    "ALTER TABLE events ADD COLUMN more TEXT",
    "ALTER TABLE events RENAME COLUMN body TO text",
    "CREATE INDEX i ON events (body)",
    "ALTER TABLE events RENAME TO old; CREATE VIEW events AS SELECT * FROM old",
    "ALTER TABLE events RENAME TO old; CREATE VIEW events AS WITH RECURSIVE n (seq) AS "
    "(SELECT 1 UNION ALL SELECT seq + 1 FROM n) SELECT seq, 'x' AS kind, '{}' AS body, 0 AS at_ns "
    "FROM n",
    "DROP TABLE events; CREATE TABLE events (seq, kind, key, body, at_ns, "
    "big AS (zeroblob(200000000)))",
)


def targets(folder: Path) -> list[Target]:
    """Return all of them."""
    return [_snapshot(), _checkpoint(folder), _cut(folder), _ledger(folder), _applied(), *_events()]


def _snapshot() -> Target:
    return Target(
        "states/snapshot", unpack, tuple(snapshot(seed).payload for seed in range(3)),
        functools.partial(formats.safetensors, key="card"), (SnapshotError,),
        ("shared.policy.snapshot:unpack", "shared.policy.snapshot:_read_card"), BOUND, 4,
    )  # fmt: skip


def _checkpoint(folder: Path) -> Target:
    home = folder / "checkpoints"
    store = checkpoint.CheckpointStore(home, "run", "antagonist", keep=2)
    made = checkpoint.Meta(
        run="run", agent="antagonist", seed=1, policy_version=1, stage=0, total_samples=1,
        applied="{}", rollouts=("a:1",), metrics=None,
    )  # fmt: skip
    store.save(made, {"actor.weight": torch.ones(4, 3), "step": torch.tensor(3.0)})
    sample = store.path(1).read_bytes()
    return Target(
        "states/checkpoint", from_file(store.path(1), functools.partial(store.load, 1)), (sample,),
        functools.partial(_sealed, key="meta", field="tensors", digest=checkpoint._digest),
        (CheckpointError,), ("services.learner.checkpoint:CheckpointStore._load",), BOUND,
    )  # fmt: skip


def _cut(folder: Path) -> Target:
    path = folder / "cut-00000001.safetensors"
    arrays = {"physics": np.ones((2, 3)), "bouts": np.arange(4)}
    cut = values.struct(Random(1), serial.Cut)
    cut = msgspec.structs.replace(cut, arrays=serial._digest(arrays))
    sample = save(arrays, metadata={"cut": json.dumps(msgspec.to_builtins(cut))})
    return Target(
        "states/cut", from_file(path, functools.partial(serial._read, path)), (sample,),
        functools.partial(_sealed, key="cut", field="arrays", digest=serial._digest),
        (CheckpointError,), ("services.jobs.train.serial:_read",), BOUND,
    )  # fmt: skip


def _sealed(random: Random, data: bytes, *, key: str, field: str, digest: Any) -> bytes:
    """Break a file whose metadata has the hash of its arrays, half of the time with it right."""
    if random.random() < 0.5:
        return formats.safetensors(random, data, key)
    arrays = dict(load(data))
    end = 8 + int.from_bytes(data[:8], "little")
    meta = json.loads(json.loads(data[8:end])["__metadata__"][key])
    name = random.choice(list(arrays))
    arrays[name] = random.choice((
        np.zeros(0), np.full(3, np.nan), np.ones((1, 1, 1, 1)), np.zeros(5, np.uint8),
        np.zeros(3, np.float16), np.ones(2, bool),
    ))  # fmt: skip
    if random.random() < 0.3:
        meta = trees.changed(random, meta)
    if isinstance(meta, dict):
        meta[field] = digest(arrays)
    return save(arrays, metadata={key: formats.to_json(random, meta).decode("utf-8", "replace")})


def _applied() -> Target:
    applied = Applied(8, 8)
    for sequence in (1, 2, 5):
        applied.add("boot", sequence)

    def read(data: bytes) -> object:
        return Applied.from_json(data.decode("utf-8", "replace"))

    return Target(
        "states/applied", read, (applied.to_json().encode(),), formats.json_text,
        (CheckpointError,), ("shared.bus.delivery:Applied.from_json",),
    )  # fmt: skip


def _events() -> list[Target]:
    return [
        Target(
            f"states/event/{kind.kind}", functools.partial(events.decode_event, kind.kind),
            tuple(events.encode_event(made) for made in _some(kind)), formats.json_text,
            (ValueError,), ("services.league.events:decode_event",), weight=2,
        )
        for kind in events.EVENTS
    ]  # fmt: skip


def _some(kind: type[events.Event]) -> list[events.Event]:
    """Return valid events of a kind; a value that its own check refuses is tried again."""
    found: list[events.Event] = []
    for seed in itertools.count():
        try:
            found.append(values.struct(Random(seed), kind))
        except ValueError:
            continue
        if len(found) == 3:
            return found
    raise AssertionError


def _ledger(folder: Path) -> Target:
    home = folder / "ledger"
    home.mkdir(parents=True, exist_ok=True)
    path = home / "league.db"
    with_events = Ledger(path)
    for kind in events.EVENTS:
        with_events.append(_some(kind)[:1], 1)
    with_events.close()
    sample = path.read_bytes()
    workshop = folder / "workshop.db"

    def read() -> object:
        with open_read_only(path) as reader:
            return list(reader.replay())

    def broken(random: Random, data: bytes) -> bytes:
        if random.random() < 0.6:
            return _pages(random, data)
        workshop.write_bytes(data)
        connection = sqlite3.connect(workshop)
        try:
            connection.execute("PRAGMA journal_mode = DELETE")
            with contextlib.suppress(sqlite3.IntegrityError):
                connection.executescript(random.choice(HOSTILE_SQL))
            connection.commit()
        finally:
            connection.close()
        made = workshop.read_bytes()
        return made if random.random() < 0.8 else _pages(random, made)

    return Target(
        "states/ledger", from_file(path, read), (sample,), broken, (LedgerError,),
        ("services.league.ledger:LedgerReader.__init__", "services.league.ledger:_read"), BOUND, 2,
    )  # fmt: skip


def _pages(random: Random, data: bytes) -> bytes:
    """Break SQLite's file: its head, the head of a page, or any bytes."""
    if random.random() < 0.5:
        return mutate.raw(random, data)
    page = 4096 * random.randrange(max(1, len(data) // 4096))
    at = page + random.randrange(112)
    return data[:at] + random.randbytes(random.choice((1, 2, 4))) + data[at + 4 :]
