"""What lies in the folder of a study: protocol, key, orders, journal, tables."""

import functools
import json
from collections.abc import Callable
from pathlib import Path
from random import Random

import msgspec

from services.jobs.study import hosting, rehearsal_plan
from services.jobs.study.rehearsal_plan import make_plan, read_plan, write_plan
from shared.errors import ConfigError, StudyError
from shared.study import recorded
from shared.study.events import Event
from shared.study.folder import AllocationRow, Study, open_study
from shared.study.journal import decode_events
from shared.study.protocol_file import SHIPPED, read_protocol, shipped_protocol
from shared.study.recorded import SessionRows
from shared.study.rows import ParticipantRow
from shared.study.tables import SESSION_TABLES, columns
from shared.study.tsv import decode_table, encode_table
from tests.fuzz import formats, mutate, trees
from tests.fuzz.target import MIB, Bound, Target, from_file
from tests.unit.study.made import play, study_in

TABLE = Bound(256, 64 * MIB)
"""A cell of three characters may be a column's number, and a text of its own."""


def targets(folder: Path) -> list[Target]:
    """Return all of them."""
    place = folder / "study"
    study = study_in(place) if not place.exists() else open_study(place)
    if not study.session_folder("sub-01").exists():
        play(study, "sub-01", is_repeated="s1-g02")
    return [
        _protocol(), _journal(study), *_texts(study, folder), *_tables(study),
        _rehearsal(study, folder / "rehearsal"), _place(folder / "place"),
    ]  # fmt: skip


def _protocol() -> Target:
    return Target(
        name="studies/protocol.toml",
        read=lambda data: read_protocol(data, "protocol.toml"),
        samples=tuple(shipped_protocol(name).read_bytes() for name in SHIPPED),
        mutate=formats.toml_text,
        refusals=(ConfigError,),
        covers=("shared.config.located:read_toml",),
    )


def _journal(study: Study) -> Target:
    steps = study.steps_of("sub-01")

    def read(data: bytes) -> object:
        events: list[Event] = decode_events(data, "journal.jsonl")[0]
        if not events:
            return None
        rows = SessionRows(study.protocol, steps, events)
        made = (rows.games(), rows.questionnaire(), rows.rankings(), rows.events())
        kinds = (
            SESSION_TABLES[name]
            for name in (recorded.GAMES, recorded.QUESTIONNAIRE, recorded.RANKINGS, recorded.EVENTS)
        )
        return [encode_table(*pair) for pair in zip(made, kinds, strict=True)], rows.participant()

    path = study.session_folder("sub-01") / "journal.jsonl"
    return Target(
        name="studies/journal.jsonl",
        read=read,
        samples=(path.read_bytes(),),
        mutate=_one_line_of_json,
        refusals=(StudyError,),
        covers=("shared.study.journal:decode_events",),
        bound=TABLE,
    )


def _one_line_of_json(random: Random, data: bytes) -> bytes:
    """Break one event of a journal, or the order of its lines."""
    if random.random() < formats.RAW:
        return mutate.raw(random, data)
    lines = data.split(b"\n")[:-1]
    place = random.randrange(len(lines))
    if random.random() < 0.2:
        lines[place : place + 1] = random.choice(([], [lines[place]] * 2, [b""], [b"{}"]))
    else:
        tree = trees.changed(random, json.loads(lines[place]))
        lines[place] = formats.to_json(random, tree).replace(b"\n", b" ")
    return b"\n".join(lines) + b"\n"


def _texts(study: Study, folder: Path) -> list[Target]:
    """Return the targets of key and orders, each in a folder that is whole but for it."""
    made: list[Target] = []
    kinds = (("key.toml", formats.toml_text), ("allocation.tsv", _one_cell))
    for name, mutator in kinds:
        place = folder / name.partition(".")[0]
        place.mkdir(parents=True, exist_ok=True)
        for each in ("protocol.toml", "key.toml", "allocation.tsv"):
            (place / each).write_bytes((study.folder / each).read_bytes())
        made.append(
            Target(
                name=f"studies/{name}",
                read=from_file(place / name, functools.partial(open_study, place)),
                samples=((study.folder / name).read_bytes(),),
                mutate=mutator,
                refusals=(ConfigError, StudyError),
                covers=("shared.study.folder:open_study",),
            )
        )
    return made


def _tables(study: Study) -> list[Target]:
    session = study.session_folder("sub-01")
    files: list[tuple[Path, type[msgspec.Struct]]] = [
        (session / name, kind) for name, kind in SESSION_TABLES.items()
    ]
    files += [
        (study.folder / "participants.tsv", ParticipantRow),
        (study.folder / "allocation.tsv", AllocationRow),
    ]
    return [
        Target(
            name=f"studies/table/{path.name}",
            read=_reader(path.name, kind),
            samples=(path.read_bytes(),),
            mutate=_one_cell,
            refusals=(StudyError,),
            covers=("shared.study.tsv:decode_table",),
            bound=TABLE,
        )
        for path, kind in files
    ]


def _reader(name: str, kind: type[msgspec.Struct]) -> Callable[[bytes], object]:
    def read(data: bytes) -> object:
        rows = decode_table(data, name, kind)
        again = decode_table(encode_table(rows, kind), name, kind)
        if again != rows:
            raise AssertionError("what was read cannot be written")
        return columns(rows, kind)

    return read


def _one_cell(random: Random, data: bytes) -> bytes:
    """Break a cell, a line or the header of a table, or its bytes."""
    if random.random() < formats.RAW:
        return mutate.raw(random, data)
    lines = [line.split(b"\t") for line in data.split(b"\n")]
    row = random.choice(lines)
    size = mutate.size_of(random, 1 << 12)
    odd = random.choice((
        b"", b"n/a", b"nan", b"inf", b"1e999", b"-0.0", b"0x10", b"1_000", b" 1", b"\\", b"\\x",
        b"\\t\\n", b"\xff", b"\x00", b"\xe2\x80\xa8", b"9" * size, b"-" + b"9" * 19, b"1" * 19,
        b"true", b"TRUE", b"\r", "٣".encode(), b"1e-400", b"x" * size, b"A,A", b",",
    ))  # fmt: skip
    place = random.randrange(len(row))
    row[place : place + 1] = random.choice(([odd], [odd], [odd, odd], []))
    if random.random() < 0.2:
        lines.insert(random.randrange(len(lines)), random.choice(lines))
    return b"\n".join(b"\t".join(row) for row in lines)


def _rehearsal(study: Study, folder: Path) -> Target:
    folder.mkdir(parents=True, exist_ok=True)
    write_plan(folder, make_plan(study.protocol, None, (), 1, is_archived=True))
    path = folder / rehearsal_plan.FILE
    return Target(
        name=f"studies/{path.name}",
        read=from_file(path, functools.partial(read_plan, folder)),
        samples=(path.read_bytes(),),
        mutate=formats.toml_text,
        refusals=(ConfigError,),
        covers=("services.jobs.study.rehearsal_plan:read_plan",),
    )


def _place(folder: Path) -> Target:
    place = {"researcher": "http://127.0.0.1:1/", "participant": "http://127.0.0.1:1/", "pid": 1}
    return Target(
        name=f"studies/{hosting.FILE}",
        read=from_file(folder / hosting.FILE, functools.partial(hosting.read_place, folder)),
        samples=(json.dumps(place).encode(),),
        mutate=formats.json_text,
        refusals=(),
        covers=("services.jobs.study.hosting:read_place",),
    )
