"""Draws the orders of a study, and writes them beside the key that tells what the labels mean."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

import tomli_w

from shared.clock import Clock
from shared.errors import StudyError
from shared.runtime.files import atomic_write
from shared.study.allocation import Allocation, allocate
from shared.study.folder import (
    ALLOCATION,
    KEY,
    AllocationRow,
    Study,
    hash_of,
    note_change,
    open_study,
    read_key,
    read_own_protocol,
)
from shared.study.protocol import Protocol
from shared.study.tsv import read_table, write_table

_KEY_HEADING: Final = """\
# What the labels of this study mean. Who analyses blinded must not read this file.
# Written by `riposte study allocate`.

"""


def draw_orders(folder: Path, people: int, seed: int, clock: Clock) -> Study:
    """Draw labels and orders of a study, or more orders of the same seed; return the study.

    Raises:
        ConfigError: as ``open_study``.
        StudyError: there are orders already, and they are not those of this seed.
    """
    data, protocol = read_own_protocol(folder)
    made = allocate(protocol, people, seed)
    there = read_table(folder / ALLOCATION, AllocationRow)
    rows = [
        AllocationRow(participant=name, order=",".join(order)) for name, order in made.assignments
    ]
    if there or (folder / KEY).exists():
        rows = _extended(folder, there, rows, made, seed)
    people = max([people, *(_number(row.participant) for row in rows)])
    key = _key(protocol, hash_of(data), made, seed, people)
    note_change(folder, f"orders drawn: {len(rows)} participants are expected", clock)
    write_table(folder / ALLOCATION, rows, AllocationRow)
    atomic_write(folder / KEY, (_KEY_HEADING + tomli_w.dumps(key)).encode(), mode=0o600)
    return open_study(folder)


def _extended(
    folder: Path, there: list[AllocationRow], rows: list[AllocationRow], made: Allocation,
    seed: int,
) -> list[AllocationRow]:  # fmt: skip
    """Return the rows that are there and those that come after all that were ever drawn.

    Raises:
        StudyError: there is no key, or what is there was not drawn from this protocol and seed.
    """
    key = read_key(folder)
    if key is None:
        raise StudyError(
            f"{folder} has no {KEY}, and {ALLOCATION} holds orders: put the key back; to begin "
            f"anew, as long as nobody has played, delete {ALLOCATION}"
        )
    meant = {label: entry.condition for label, entry in key.label.items()}
    by_name = {row.participant: row for row in rows}
    is_other = any(by_name.get(row.participant, row) != row for row in there)
    if key.seed != seed or meant != made.labels or is_other:
        raise StudyError(
            f"{folder / ALLOCATION} holds other orders: draw more people with the seed it was "
            f"drawn with (in {KEY}); to begin anew, as long as nobody has played, delete "
            f"{ALLOCATION} and {KEY}"
        )
    last = max([key.people, *(_number(row.participant) for row in there)])
    return [*there, *(row for row in rows if _number(row.participant) > last)]


def _number(participant: str) -> int:
    return int(participant.removeprefix("sub-"))


def _key(
    protocol: Protocol, digest: str, made: Allocation, seed: int, people: int
) -> Mapping[str, object]:
    return {
        "schema": 1,
        "study": protocol.name,
        "seed": seed,
        "people": people,
        "protocol": digest,
        "label": {
            label: {"condition": name, "player": protocol.condition_named(name).player}
            for label, name in made.labels.items()
        },
    }
