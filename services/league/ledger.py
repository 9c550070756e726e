"""The append-only record of a run: one SQLite file that only the league writes."""

import contextlib
import fcntl
import os
import sqlite3
from collections.abc import Generator, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from services.league.events import Entry, Event, decode_event, encode_event
from shared.errors import LedgerError

APPLICATION_ID = 0x52495053
"""``RIPS``: marks an SQLite file as a ledger of ours."""
SCHEMA_VERSION = 1
BUSY_TIMEOUT = 5.0
"""Seconds to wait for a reader that holds the file, say while it copies it."""
_CREATE = """
CREATE TABLE events (
    seq INTEGER PRIMARY KEY,
    kind TEXT NOT NULL,
    key TEXT NOT NULL,
    body TEXT NOT NULL,
    at_ns INTEGER NOT NULL,
    UNIQUE (kind, key)
)
"""
E = TypeVar("E", bound=Event)
_OUT_OF_SPACE = (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR)
_DAMAGED = (sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)


class Ledger:
    """Events in the order they happened, each (kind, key) at most once.

    Write-ahead log with ``synchronous=FULL``: what was acknowledged must survive a power cut too,
    and one sync a tick, shared by all requests of that tick, costs little.
    """

    def __init__(self, path: Path) -> None:
        """Open the ledger for writing, or make a new one.

        Raises:
            LedgerError: another process writes it, it is damaged or no ledger, or the folder or
                the file cannot be written.
        """
        self.path = path
        self._lock = _take_lock(path)
        try:
            self._connection = self._open()
        except BaseException:
            os.close(self._lock)
            raise
        try:
            self.check_writable()
        except BaseException:
            self.close()
            raise

    def _open(self) -> sqlite3.Connection:
        with _explained(self.path):
            connection = sqlite3.connect(self.path, timeout=BUSY_TIMEOUT, isolation_level=None)
            try:
                if not _is_made(connection):
                    _create(connection)
                _check(connection, self.path)
                connection.execute("PRAGMA synchronous = FULL")
            except BaseException:
                connection.close()
                raise
        return connection

    @property
    def position(self) -> int:
        """Return the sequence number of the last event, 0 in an empty ledger."""
        with _explained(self.path):
            row = self._connection.execute("SELECT max(seq) FROM events").fetchone()
        return int(row[0] or 0)

    def append(self, events: Sequence[Event], at_ns: int) -> list[Entry]:
        """Write the events in one transaction and return those that were not there before.

        Once this returns they are on disk; when it raises, none of them is in the ledger.

        Raises:
            LedgerError: no space, or the file can no longer be written.
        """
        entries: list[Entry] = []
        with _explained(self.path), self._transaction():
            last = self.position
            for event in events:
                row = (last + 1, event.kind, event.key, encode_event(event).decode(), at_ns)
                cursor = self._connection.execute(
                    "INSERT INTO events VALUES (?, ?, ?, ?, ?) ON CONFLICT (kind, key) DO NOTHING",
                    row,
                )
                if cursor.rowcount:
                    last += 1
                    entries.append(Entry(seq=last, at_ns=at_ns, event=event))
        return entries

    def check_writable(self) -> None:
        """Write something that changes nothing.

        Raises:
            LedgerError: no space, or the file can no longer be written.
        """
        with _explained(self.path), self._transaction():
            self._connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")

    def replay(self) -> Iterator[Entry]:
        """Yield every event, oldest first.

        Raises:
            LedgerError: the file is damaged, or a newer Riposte wrote it.
        """
        return _read(self._connection, self.path)

    def find(self, kind: type[E], key: str) -> E | None:
        """Return the event of a kind under a key, None when there is none.

        Raises:
            LedgerError: the file is damaged.
        """
        query = "SELECT body FROM events WHERE kind = ? AND key = ?"
        with _explained(self.path):
            row = self._connection.execute(query, (kind.kind, key)).fetchone()
        if row is None:
            return None
        event = _decoded(self.path, f"{kind.kind} {key}", kind.kind, row[0])
        assert isinstance(event, kind)
        return event

    def rewind(self, seq: int) -> None:
        """Forget every event after ``seq``; only for resuming a serial run from a cut.

        Raises:
            LedgerError: the ledger ends before ``seq``, or cannot be written.
        """
        if seq > self.position:
            raise LedgerError(
                f"ledger {self.path} ends at event {self.position}, before the cut at event {seq}; "
                "it is not the ledger of this cut"
            )
        with _explained(self.path), self._transaction():
            self._connection.execute("DELETE FROM events WHERE seq > ?", (seq,))

    def close(self) -> None:
        """Close the file and let another process write it; a second call does nothing."""
        if self._lock < 0:
            return
        # A clean end folds the write-ahead log in; if that fails the log is folded in next time.
        with contextlib.suppress(sqlite3.Error):
            self._connection.close()
        os.close(self._lock)
        self._lock = -1

    @contextlib.contextmanager
    def _transaction(self) -> Generator[None]:
        self._connection.execute("BEGIN IMMEDIATE")
        try:
            yield
            self._connection.execute("COMMIT")
        except BaseException:
            with contextlib.suppress(sqlite3.Error):  # SQLite may have rolled back already
                self._connection.execute("ROLLBACK")
            raise


class LedgerReader:
    """A ledger opened to be read, while the league may be writing it.

    One that is only being made, or whose league was stopped then, has no events.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        if not path.is_file():
            raise LedgerError(f"there is no ledger {path}; give the folder of a run")
        with _explained(path):
            self._connection = _connect_read_only(path)
            try:
                # The league makes the file, and in one transaction everything in it.
                self._is_made = _is_made(self._connection)
                if self._is_made:
                    _check(self._connection, path)
            except BaseException:
                self._connection.close()
                raise

    def replay(self, after: int = 0) -> Iterator[Entry]:
        """Yield every event numbered above ``after``, oldest first.

        Raises:
            LedgerError: the file is damaged, or a newer Riposte wrote it.
        """
        return _read(self._connection, self.path, after) if self._is_made else iter(())

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def __enter__(self) -> "LedgerReader":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def open_read_only(path: Path) -> LedgerReader:
    """Return the ledger for reading; for reports.

    Raises:
        LedgerError: it is not there, damaged, or no ledger of ours.
    """
    return LedgerReader(path)


def _connect_read_only(path: Path) -> sqlite3.Connection:
    uri = path.absolute().as_uri()
    connection = sqlite3.connect(f"{uri}?mode=ro", uri=True, timeout=BUSY_TIMEOUT)
    try:
        connection.execute("SELECT 1 FROM sqlite_master LIMIT 1")
    except sqlite3.OperationalError:
        # A write-ahead log needs a writable folder beside it. On a read-only medium without a
        # log, nobody writes, and the file alone is the whole ledger.
        connection.close()
        if path.with_name(path.name + "-wal").exists():
            raise
        connection = sqlite3.connect(f"{uri}?mode=ro&immutable=1", uri=True)
    return connection


def _is_made(connection: sqlite3.Connection) -> bool:
    return connection.execute("SELECT 1 FROM sqlite_master LIMIT 1").fetchone() is not None


def _create(connection: sqlite3.Connection) -> None:
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("BEGIN IMMEDIATE")
    connection.execute(_CREATE)
    connection.execute(f"PRAGMA application_id = {APPLICATION_ID}")
    connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION}")
    connection.execute("COMMIT")


def _check(connection: sqlite3.Connection, path: Path) -> None:
    if connection.execute("PRAGMA application_id").fetchone()[0] != APPLICATION_ID:
        raise LedgerError(
            f"{path} is an SQLite file of another program, not a league ledger; "
            "move it away or choose another folder"
        )
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    if version != SCHEMA_VERSION:
        raise LedgerError(
            f"ledger {path} has schema version {version}, this Riposte reads {SCHEMA_VERSION}; "
            "use the version of Riposte that made the run"
        )
    made = connection.execute(
        "SELECT type, name, sql FROM sqlite_master WHERE name NOT LIKE 'sqlite_%'"
    ).fetchall()
    if made != [("table", "events", _CREATE.strip())]:  # a view could count for ever
        names = ", ".join(f"{kind} {name}" for kind, name, _ in made)[:200]
        raise LedgerError(
            f"ledger {path} is damaged (it is made of {names or 'nothing'}, expected the table "
            f"events as the league makes it); {_RESTORE}"
        )
    findings = " ".join(connection.execute("PRAGMA quick_check(1)").fetchone()[0].split())
    if findings != "ok":
        raise LedgerError(f"ledger {path} is damaged ({findings}); {_RESTORE}")
    count, last = connection.execute("SELECT count(*), max(seq) FROM events").fetchone()
    if count and count != last:
        raise LedgerError(
            f"ledger {path} is damaged ({count} events, the last numbered {last}); {_RESTORE}"
        )


def _read(connection: sqlite3.Connection, path: Path, after: int = 0) -> Iterator[Entry]:
    query = "SELECT seq, kind, body, at_ns FROM events WHERE seq > ? ORDER BY seq"
    with _explained(path):
        rows = connection.execute(query, (after,))
        for seq, kind, body, at_ns in rows:
            yield Entry(seq=seq, at_ns=at_ns, event=_decoded(path, f"event {seq}", kind, body))


def _decoded(path: Path, where: str, kind: str, body: str) -> Event:
    try:
        return decode_event(kind, body)
    except ValueError as error:
        raise LedgerError(f"ledger {path} is damaged at {where}: {error}; {_RESTORE}") from error


_RESTORE = "restore it from a copy, or start a new run in another folder"


@contextlib.contextmanager
def _explained(path: Path) -> Generator[None]:
    """Turn SQLite's errors into one line that says what to do."""
    try:
        yield
    except UnicodeDecodeError as error:  # SQLite quotes a damaged schema in its error
        raise LedgerError(f"ledger {path} is damaged ({error}); {_RESTORE}") from error
    except sqlite3.Error as error:
        code = getattr(error, "sqlite_errorcode", 0)
        primary = code & 0xFF
        if primary in _DAMAGED:
            text = f"ledger {path} is damaged ({error}); {_RESTORE}"
        elif primary in _OUT_OF_SPACE:
            text = (
                f"ledger {path} cannot grow ({error}): free space on its disk; "
                "nothing that was acknowledged is lost"
            )
        elif primary == sqlite3.SQLITE_BUSY:
            text = (
                f"ledger {path} was held by another program for {BUSY_TIMEOUT:g} s ({error}); "
                "close what has it open"
            )
        else:
            text = f"ledger {path} cannot be used ({error}); make file and folder writable"
        raise LedgerError(text) from error


def _take_lock(path: Path) -> int:
    """Return the descriptor that holds the right to write.

    A file of its own: closing any descriptor of a database drops SQLite's locks on it.
    """
    lock = path.with_name(path.name + ".lock")
    try:
        lock.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise LedgerError(
            f"ledger {path} cannot be written ({error.strerror}); make the folder writable"
        ) from error
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        os.close(descriptor)
        raise LedgerError(
            f"ledger {path} is being written by another league; stop it, or choose another folder"
        ) from error
    return descriptor
