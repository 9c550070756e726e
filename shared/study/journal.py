"""The journal of a session: every event on the disk before it counts, none lost, none doubled.

``journal.jsonl`` only ever grows, by one line an event. A line that a kill or a full disk cut short
was not counted by anybody, and is dropped when the journal is opened again.
"""

import os
from pathlib import Path
from typing import Final

import msgspec

from shared.clock import Clock
from shared.errors import StudyError
from shared.runtime.files import RunLock, append_at, explain, sync_folder
from shared.study.events import Event, SessionBegan, What
from shared.study.instants import clock_problem

FILE: Final = "journal.jsonl"
MAX_BYTES: Final = 64 << 20
"""Of a journal: some 200,000 events."""
LAST_BYTES: Final = 2 << 20
"""Of a journal, in which its last line is looked for: answers have at most half of that."""

_ENCODER = msgspec.json.Encoder()
_DECODER = msgspec.json.Decoder(Event)


class Journal:
    """A session's journal, held by the one process that may write it."""

    def __init__(self, folder: Path, clock: Clock) -> None:
        """Open or begin the journal of a session's folder.

        Args:
            folder: the session's; made where it is not there.
            clock: dates the events.

        Raises:
            StudyError: the journal is damaged, or the wall clock cannot be right.
            RiposteError: another process writes it, or it cannot be written.
        """
        self._clock = clock
        self._lock = RunLock(folder)
        self._file: int | None = None
        self.path = folder / FILE
        try:
            self._open(folder)
        except BaseException:
            self.close()
            raise

    @property
    def events(self) -> tuple[Event, ...]:
        """Return all events so far."""
        return tuple(self._events)

    def write(self, what: What, step: str = "", ask: str = "") -> Event:
        """Add an event; when this returns it is on the disk.

        Args:
            what: happened.
            step: id of the step that it belongs to.
            ask: id of the page's ask that it came of.

        Raises:
            RiposteError: there is no space, or the file cannot be written; the journal is as it
                was, and the event has not happened.
            ValueError: the journal is closed, or its first event is no ``session_began``.
        """
        if self._file is None:
            raise ValueError("the journal is closed")
        if isinstance(what, SessionBegan) == bool(self._events):
            raise ValueError("a journal begins with session_began, and has it once")
        event = Event(
            number=len(self._events) + 1,
            t_ns=round(self._clock.now() * 1e9),
            wall_ns=self._clock.wall_ns(),
            step=step,
            ask=ask,
            what=what,
        )
        line = _ENCODER.encode(event) + b"\n"
        self._size = append_at(self._file, self._size, line, self.path, is_synced=True)
        self._events.append(event)
        return event

    def close(self) -> None:
        """Let another process write it; a second call does nothing."""
        if self._file is not None:
            os.close(self._file)
            self._file = None
        self._lock.close()

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _open(self, folder: Path) -> None:
        is_new = not self.path.exists()
        try:
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            data = b"" if is_new else _read(self.path)
        except OSError as error:
            raise explain(error, self.path, 0) from error
        self._events, self._size = decode_events(data, str(self.path))
        last = self._events[-1].wall_ns if self._events else 0
        if (problem := clock_problem(self._clock.wall_ns(), last)) is not None:
            raise StudyError(f"{self.path.parent}: {problem}")
        if self._size < len(data):
            os.ftruncate(self._file, self._size)
            os.fsync(self._file)
        if is_new:
            sync_folder(folder)


def read_journal(folder: Path) -> tuple[Event, ...]:
    """Return the events of a session's folder, also while it is being written; empty without one.

    Raises:
        StudyError: the journal is damaged or cannot be read.
    """
    path = folder / FILE
    try:
        data = _read(path)
    except FileNotFoundError:
        return ()
    except OSError as error:
        raise StudyError(f"cannot read {path}: {error.strerror or error}") from error
    return tuple(decode_events(data, str(path))[0])


def last_event(folder: Path) -> Event | None:
    """Return the last event of a session's folder, without reading the others.

    None where there is no journal, or its last line is none.
    """
    try:
        with (folder / FILE).open("rb") as file:
            file.seek(max(file.seek(0, os.SEEK_END) - LAST_BYTES, 0))
            lines = file.read(LAST_BYTES).split(b"\n")[:-1]  # the rest was cut short
        return _DECODER.decode(lines[-1]) if lines else None
    except (OSError, msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None


def decode_events(data: bytes, name: str) -> tuple[list[Event], int]:
    """Return the events in the bytes of a journal, and how many bytes they take.

    What follows the last line feed is a line that was cut short.

    Args:
        data: the file's bytes.
        name: of the file, for messages.

    Raises:
        StudyError: a whole line is no event, or is not the one that must follow.
    """
    if len(data) > MAX_BYTES:
        raise StudyError(f"{name}: {len(data)} bytes are too many, at most {MAX_BYTES} are read")
    size = data.rfind(b"\n") + 1
    events: list[Event] = []
    for number, line in enumerate(data[:size].split(b"\n")[:-1], start=1):
        try:
            event = _DECODER.decode(line)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise StudyError(
                f"{name}:{number}: damaged: {error}; put back a copy, or move the file away"
            ) from error
        if event.number != number:
            raise StudyError(
                f"{name}:{number}: this is event {event.number}, expected {number}: "
                "a line was taken out or put in"
            )
        if isinstance(event.what, SessionBegan) != (number == 1):
            raise StudyError(f"{name}:{number}: a journal begins with session_began, once")
        events.append(event)
    return events, size


def _read(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(MAX_BYTES + 1)
