"""What a researcher should know before a study begins, and of the data that are there."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Literal, NamedTuple

from shared.errors import StudyError
from shared.study.allocation import block_size
from shared.study.folder import ALLOCATION, KEY, Study
from shared.study.protocol import Protocol
from shared.study.recorded import (
    EVENTS,
    GAMES,
    QUESTIONNAIRE,
    RANKINGS,
    SessionRows,
    rows_of,
)
from shared.study.rows import EventRow, GameRow, QuestionnaireRow, RankingRow
from shared.study.steps import steps_of
from shared.study.tables import SESSION_TABLES
from shared.study.tsv import encode_table, read_table

PLACEHOLDER: Final = "REPLACE THIS TEXT"
"""What the consent of a shipped protocol begins with."""
BYTES_PER_SECOND: Final = 250_000
"""Of a game: its archive and its part of recording.rrd (docs/recordings.md, "What it costs")."""
GIB: Final = 1 << 30


class Remark(NamedTuple):
    """One thing to know."""

    level: Literal["ok", "note", "error"]
    text: str


def protocol_remarks(protocol: Protocol) -> Iterator[Remark]:
    """Yield what is worth knowing of a protocol that can be read."""
    steps = steps_of(protocol, [condition.name for condition in protocol.condition])
    games = [step for step in steps if step.kind == "game"]
    minutes = sum(step.seconds for step in steps) / 60.0
    yield Remark(
        "ok",
        f"{protocol.name}: {len(protocol.section)} sections, {len(games)} games, {len(steps)} "
        f"steps, {minutes:.0f} min without questions, for {protocol.people} people",
    )
    if PLACEHOLDER in protocol.consent.text:
        yield Remark(
            "note", "consent.text is a placeholder: put in the one your ethics board approved"
        )
    block = block_size(protocol)
    if protocol.people % block:
        yield Remark(
            "note",
            f"people is {protocol.people}: the Williams design is balanced with a multiple of "
            f"{block}",
        )
    asked = {step.instrument for step in steps}
    for instrument in protocol.instrument:
        if instrument.name not in asked:
            yield Remark("note", f"instrument {instrument.name!r} is never asked")


def study_remarks(study: Study) -> Iterator[Remark]:
    """Yield what is worth knowing of a study's folder and its data."""
    if not study.assignments:
        yield Remark("note", f"no orders yet: {ALLOCATION} comes from `riposte study allocate`")
    elif study.key is None:
        yield Remark("note", f"{KEY} is elsewhere: no session can begin, nothing is unblinded")
    for path in sorted(study.folder.glob(".withdrawn-*")):
        name = path.name.removeprefix(".withdrawn-")
        yield Remark("error", f"a withdrawal was interrupted: say it again, --participant {name}")
    yield from _room(study)
    sessions = study.sessions()
    for participant, number, folder in sessions:
        try:
            yield from _session(study, participant, number, folder)
        except StudyError as error:
            yield Remark("error", str(error))
    if study.assignments:
        yield Remark(
            "ok", f"{len(sessions)} sessions of {len(study.assignments)} participants are there"
        )


def _room(study: Study) -> Iterator[Remark]:
    """Yield how much room the participants who have not played need on the disk."""
    played = {participant for participant, _, _ in study.sessions()}
    people = [each for each in study.assignments if each.participant not in played]
    seconds = sum(section.games for section in study.protocol.section) * study.protocol.game.seconds
    needed = len(people) * seconds * BYTES_PER_SECOND
    free = shutil.disk_usage(study.folder).free
    if free < needed:
        yield Remark(
            "note",
            f"{len(people)} people who have not played need about {needed / GIB:.1f} GiB, and "
            f"{free / GIB:.1f} GiB are free: free some, or put the study elsewhere",
        )


def _session(study: Study, participant: str, number: int, folder: Path) -> Iterator[Remark]:
    rows = rows_of(study, participant, number)
    place = f"{participant}, session {number}"
    if rows is None:
        yield Remark("note", f"{place}: has not begun")
        return
    for name, kind in SESSION_TABLES.items():
        read_table(folder / name, kind)
    row = rows.participant()
    planned = sum(section.games for section in study.protocol.section)
    if row.games == planned and row.state == "ended":
        yield Remark("ok", f"{place}: ended, {row.games} games")
    else:
        yield Remark("note", f"{place}: {row.state}, {row.games} of {planned} games count")
    behind = [name for name, data in _tables(rows) if _bytes(folder / name) != data]
    if behind:
        yield Remark(
            "note",
            f"{place}: {', '.join(behind)} differ from the journal; `riposte study export` and "
            "`analyse` write them anew",
        )
    missing = [
        game.bout for game in rows.games()
        if game.is_recorded and game.outcome == "finished"
        and not (folder / "bouts" / game.bout / "bout.json").is_file()
    ]  # fmt: skip
    if missing:
        yield Remark(
            "note", f"{place}: no archive of {', '.join(missing[:3])}"
            + (f" and {len(missing) - 3} more games" if len(missing) > 3 else ""),
        )  # fmt: skip


def _tables(rows: SessionRows) -> list[tuple[str, bytes]]:
    return [
        (GAMES, encode_table(rows.games(), GameRow)),
        (QUESTIONNAIRE, encode_table(rows.questionnaire(), QuestionnaireRow)),
        (RANKINGS, encode_table(rows.rankings(), RankingRow)),
        (EVENTS, encode_table(rows.events(), EventRow)),
    ]


def _bytes(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() else b""
