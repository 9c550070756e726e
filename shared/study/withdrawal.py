"""A participant withdraws: everything of theirs is deleted, and one line says that somebody did."""

import shutil
from pathlib import Path
from typing import Final

from shared.clock import Clock
from shared.errors import StudyError
from shared.runtime.files import RunLock, sync_folder
from shared.study.folder import (
    ALLOCATION,
    CHANGES,
    DESCRIPTION,
    KEY,
    PARTICIPANTS,
    PROTOCOL,
    AllocationRow,
    check_participant,
    note_change,
)
from shared.study.rows import ParticipantRow
from shared.study.tsv import read_table, write_table

LINE: Final = "a participant withdrew: everything of theirs was deleted"
_OWN: Final = {DESCRIPTION, PROTOCOL, ALLOCATION, KEY, PARTICIPANTS, CHANGES}


def withdraw(folder: Path, participant: str, clock: Clock) -> tuple[Path, ...]:
    """Delete everything of a participant from a study's folder.

    Whoever was interrupted says it again. The recordings go first: a damaged protocol or table
    keeps nobody's data.

    Args:
        folder: the study's.
        participant: whose.
        clock: dates the line in CHANGES.

    Returns:
        What else lies in the folder and may hold their data: reports made before.

    Raises:
        StudyError: there is nothing of theirs, or a table cannot be read.
        RiposteError: their session is going on, or something cannot be written.
    """
    check_participant(participant)
    going = folder / f".withdrawn-{participant}"
    there = folder / participant
    allocated = folder / ALLOCATION
    if there.is_dir():
        _set_aside(there, going)
    is_found = going.exists()
    _delete(going)
    rows = read_table(allocated, AllocationRow)
    others = [row for row in rows if row.participant != participant]
    sessions = read_table(folder / PARTICIPANTS, ParticipantRow)
    kept = [row for row in sessions if row.participant != participant]
    if not is_found and len(others) == len(rows) and len(kept) == len(sessions):
        raise StudyError(f"there is nothing of {participant} in {folder}")
    if len(kept) < len(sessions):
        write_table(folder / PARTICIPANTS, kept, ParticipantRow)
    note_change(folder, LINE, clock)
    if len(others) < len(rows):
        write_table(allocated, others, AllocationRow)
    return tuple(
        path for path in sorted(folder.iterdir())
        if path.name not in _OWN and not path.name.startswith(("sub-", "."))
    )  # fmt: skip


def _set_aside(there: Path, going: Path) -> None:
    """Take the folder's name away while nobody writes into it.

    Raises:
        RiposteError: a session is going on.
    """
    locks = [RunLock(path) for path in sorted(there.glob("ses-*")) if path.is_dir()]
    try:
        _delete(going)
        there.rename(going)
        sync_folder(going.parent)
    finally:
        for lock in locks:
            lock.close()


def _delete(going: Path) -> None:
    if not going.exists():
        return
    try:
        shutil.rmtree(going)
    except OSError as error:
        raise StudyError(
            f"cannot delete {error.filename or going}: {error.strerror or error}; mend that, and "
            "say it again"
        ) from error
    sync_folder(going.parent)
