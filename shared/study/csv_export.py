"""A study as CSV files, for R, SPSS or a spreadsheet; blinded unless asked otherwise."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import msgspec

from shared.errors import StudyError
from shared.runtime.files import atomic_write
from shared.study.folder import PARTICIPANTS, Study
from shared.study.recorded import EVENTS, GAMES, HEART_RATE, QUESTIONNAIRE, RANKINGS, rows_of
from shared.study.rows import NoteRow, ParticipantRow
from shared.study.tables import SESSION_TABLES, named, session_rows
from shared.study.tsv import columns_of, read_table

FILES: Final = {
    GAMES: "games.csv", HEART_RATE: "heart_rate.csv", QUESTIONNAIRE: "questionnaire.csv",
    RANKINGS: "rankings.csv", EVENTS: "events.csv",
}  # fmt: skip
TELLING: Final = ("policy",)
"""Columns that tell a condition; empty in a blinded export."""


def export(study: Study, out: Path, unblind: bool = False) -> dict[str, int]:
    """Write a study's tables as CSV; return how many rows each file has.

    Args:
        study: its tables must be up to date (``recorded.refresh``).
        out: a new folder, or an empty one.
        unblind: conditions by name, and who played, by the study's key.

    Raises:
        StudyError: a table is damaged, there is no key, or ``out`` holds something.
        RiposteError: it cannot be written.
    """
    names = study.conditions if unblind else None
    rows: dict[str, tuple[type[msgspec.Struct], Sequence[msgspec.Struct]]] = {
        "participants.csv": (
            ParticipantRow,
            read_table(study.folder / PARTICIPANTS, ParticipantRow),
        ),
        "notes.csv": (NoteRow, _notes(study)),
    }
    for table, file in FILES.items():
        rows[file] = (SESSION_TABLES[table], session_rows(study, table))
    _check_empty(out)
    for file, (kind, found) in rows.items():
        atomic_write(out / file, _csv(file, kind, found, names))
    return {file: len(found) for file, (_, found) in rows.items()}


def _notes(study: Study) -> list[NoteRow]:
    found = [rows_of(study, participant, number) for participant, number, _ in study.sessions()]
    return [note for rows in found if rows is not None for note in rows.notes()]


def _check_empty(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
        is_empty = not any(out.iterdir())
    except OSError as error:
        raise StudyError(f"cannot write into {out}: {error.strerror or error}") from error
    if not is_empty:
        raise StudyError(f"{out} is not empty: name a new folder with --out")


def _csv(
    file: str, kind: type[msgspec.Struct], rows: Sequence[msgspec.Struct],
    names: Mapping[str, str] | None,
) -> bytes:  # fmt: skip
    columns = columns_of(kind)
    text = io.StringIO()
    writer = csv.writer(text)
    writer.writerow(columns)
    for row in rows:
        writer.writerow([_cell(file, column, getattr(row, column), names) for column in columns])
    return text.getvalue().encode()


def _cell(file: str, column: str, value: object, names: Mapping[str, str] | None) -> object:
    if isinstance(value, bool):
        return "true" if value else "false"
    if column in ("condition", "order") and names is not None:
        return named(file, str(value), names)
    return "" if column in TELLING and names is None else value
