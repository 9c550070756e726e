import contextlib
import os
import resource
import shutil
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from services.league.events import IncidentNoted, RunFinished, RunStarted
from services.league.ledger import Ledger, open_read_only
from shared.bus.base import Refused
from shared.errors import LedgerError
from shared.messages.league import SnapshotRequest
from shared.messages.topics import SNAPSHOT
from tests.unit.league.driving import SMALL, Match, snapshot

START = RunStarted(run="r", seed=1, serial=False, config=SMALL)


def incident(number: int, detail: str = "d") -> IncidentNoted:
    return IncidentNoted(
        source="s", boot="b", sequence=number, what="w", detail=detail, reported_at_ns=1
    )


def written(path: Path, events: int = 200) -> Path:
    ledger = Ledger(path)
    ledger.append([START], 1)
    ledger.append([incident(number, "x" * 100) for number in range(events)], 2)
    ledger.close()
    return path


@contextmanager
def no_room(limit: int) -> Iterator[None]:
    """Let no file of this process grow over ``limit`` bytes, as a full disk would."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_events_come_back_in_order_and_whole(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "l")
    ledger.append([START, incident(0)], 5)
    ledger.append([RunFinished()], 6)
    entries = list(ledger.replay())
    assert [(e.seq, e.at_ns) for e in entries] == [(1, 5), (2, 5), (3, 6)]
    assert [e.event for e in entries] == [START, incident(0), RunFinished()]
    ledger.close()


def test_an_event_is_entered_once_by_kind_and_key(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "l")
    assert [e.seq for e in ledger.append([START, incident(0)], 1)] == [1, 2]
    assert [e.seq for e in ledger.append([incident(0, "other"), incident(1)], 2)] == [3]
    assert ledger.position == 3
    ledger.close()


def test_a_failed_transaction_leaves_nothing(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "l")
    with pytest.raises(AttributeError):
        ledger.append([START, object()], 1)  # type: ignore[list-item]
    assert ledger.position == 0
    ledger.append([START], 1)
    ledger.close()


def test_rewinding_forgets_what_came_after(tmp_path: Path) -> None:
    ledger = Ledger(written(tmp_path / "l"))
    ledger.rewind(3)
    assert [e.seq for e in ledger.append([incident(900)], 3)] == [4]
    ledger.close()


def test_a_second_writer_is_turned_away_and_readers_are_not(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "l")
    ledger.append([START], 1)
    with pytest.raises(LedgerError, match="being written by another league"):
        Ledger(tmp_path / "l")
    with open_read_only(tmp_path / "l") as reader:
        ledger.append([incident(0)], 2)
        assert len(list(reader.replay())) == 2
    ledger.close()
    ledger.close()
    Ledger(tmp_path / "l").close()


def open_to_all(folder: Path) -> None:
    """Let any user into a folder of pytest's, which are ours alone."""
    for each in (folder, *folder.parents):
        if each.stat().st_uid == os.getuid() and each.stat().st_mode & 0o777 == 0o700:
            each.chmod(0o755)


def test_a_reader_needs_no_writable_folder(tmp_path: Path) -> None:
    path = written(tmp_path / "l")
    path.with_name("l.lock").unlink()
    code = (
        "import os, sys, pathlib\n"
        "from services.league.ledger import open_read_only\n"
        "os.setuid(65534) if os.getuid() == 0 else None\n"
        "print(len(list(open_read_only(pathlib.Path(sys.argv[1])).replay())))"
    )
    tmp_path.chmod(0o555)
    os.chmod(path, 0o444)
    open_to_all(tmp_path.parent)
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=False
    )
    tmp_path.chmod(0o755)
    assert done.stdout.strip() == "201", done.stderr


def test_a_ledger_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "l")
    code = (
        "import os, sys, pathlib\n"
        "from services.league.ledger import Ledger\n"
        "from shared.errors import LedgerError\n"
        "os.setuid(65534) if os.getuid() == 0 else None\n"
        "try:\n    Ledger(pathlib.Path(sys.argv[1]))\n"
        "except LedgerError as error:\n    print(error)"
    )
    open_to_all(tmp_path.parent)

    def said(folder: int, file: int, lock: int) -> str:
        tmp_path.chmod(folder)
        path.chmod(file)
        path.with_name("l.lock").chmod(lock)
        done = subprocess.run(
            [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=False
        )
        tmp_path.chmod(0o755)
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert "make the folder writable" in said(0o555, 0o444, 0o444)
    assert "make file and folder writable" in said(0o777, 0o444, 0o666)


def _truncate(path: Path) -> None:
    os.truncate(path, path.stat().st_size // 2)


def _scribble(path: Path) -> None:
    size = path.stat().st_size
    with path.open("r+b") as file:
        file.seek(4096)
        file.write(b"\xa5" * (size - 4096))


def _text(path: Path) -> None:
    path.write_text("this is not a database, however long one makes it\n" * 50)


def _foreign(path: Path) -> None:
    path.unlink()
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE events (seq INTEGER)")


def _newer(path: Path) -> None:
    with sqlite3.connect(path) as ledger:
        ledger.execute("PRAGMA user_version = 2")


def _gap(path: Path) -> None:
    with sqlite3.connect(path) as ledger:
        ledger.execute("DELETE FROM events WHERE seq = 7")


@pytest.mark.parametrize(
    ("harm", "text"),
    [
        (_truncate, "is damaged"),
        (_scribble, "is damaged"),
        (_text, "is damaged"),
        (_foreign, "SQLite file of another program"),
        (_newer, "has schema version 2, this Riposte reads 1"),
        (_gap, "is damaged .200 events, the last numbered 201"),
    ],
)
@pytest.mark.parametrize("opened", [Ledger, open_read_only])
def test_a_bad_file_is_refused_in_one_line(
    tmp_path: Path, harm: Callable[[Path], None], text: str, opened: Callable[[Path], object]
) -> None:
    path = written(tmp_path / "l")
    harm(path)
    before = path.read_bytes()
    with pytest.raises(LedgerError, match=text) as caught:
        opened(path)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == before


def test_an_event_of_an_unknown_kind_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "l")
    with sqlite3.connect(path) as ledger:
        ledger.execute("UPDATE events SET kind = 'later' WHERE seq = 9")
    with pytest.raises(LedgerError, match="at event 9: event kind 'later' is unknown"):
        list(open_read_only(path).replay())


def test_a_missing_ledger_is_not_made_by_a_reader(tmp_path: Path) -> None:
    with pytest.raises(LedgerError, match="there is no ledger"):
        open_read_only(tmp_path / "l")
    assert not list(tmp_path.iterdir())


def _nothing(path: Path) -> None:
    path.touch()


def _only_a_header(path: Path) -> None:
    with contextlib.closing(sqlite3.connect(path)) as connection:
        connection.execute("PRAGMA journal_mode = WAL")


@pytest.mark.parametrize("stopped", [_nothing, _only_a_header])
def test_a_ledger_whose_making_was_stopped_has_no_events_and_is_made_again(
    tmp_path: Path, stopped: Callable[[Path], None]
) -> None:
    path = tmp_path / "l"
    stopped(path)
    with open_read_only(path) as reader:
        assert list(reader.replay()) == []
    Ledger(path).close()
    with open_read_only(path) as reader:
        assert list(reader.replay()) == []


def test_a_reader_that_comes_while_it_is_made_finds_no_fault(tmp_path: Path) -> None:
    paths = [tmp_path / str(number) for number in range(60)]

    def make() -> None:
        for path in paths:
            Ledger(path).close()

    maker = threading.Thread(target=make)
    maker.start()
    early = 0
    for path in paths:
        while not path.exists():
            early += 1
        with open_read_only(path) as reader:
            assert list(reader.replay()) == []
    maker.join()
    assert early


def test_what_did_not_fit_is_not_in_the_ledger(tmp_path: Path) -> None:
    ledger = Ledger(tmp_path / "l")
    ledger.append([START], 1)
    room = (tmp_path / "l-wal").stat().st_size
    with no_room(room), pytest.raises(LedgerError, match=r"cannot grow .*free space"):
        ledger.append([incident(number, "x" * 5000) for number in range(20)], 2)
    assert ledger.position == 1
    ledger.append([incident(1)], 2)
    assert len(list(ledger.replay())) == 2
    ledger.close()


def test_a_league_on_a_full_disk_refuses_with_the_reason_and_recovers(tmp_path: Path) -> None:
    match = Match(tmp_path)
    match.both_start()
    lease = match.lease()
    before = match.league.ledger_position
    room = max(path.stat().st_size for path in tmp_path.rglob("*") if path.is_file())
    with no_room(room):
        answers = [match.play(lease, sequence=1, bouts=3000)]
        answers += [match.note(1), match.renew(lease), match.report("antagonist", 1, 0)]
        served = match.ask(
            SNAPSHOT, SnapshotRequest(snapshot=snapshot("antagonist", 0, -1).reference)
        )
        match.clock.advance(1.0)
        match.note(1)
    assert all(isinstance(answer, Refused) and answer.retry for answer in answers), answers
    assert "free space on its disk" in answers[0].reason
    assert served.found
    assert match.league.ledger_position == before
    match.clock.advance(1.0)
    assert match.renew(lease).alive
    assert match.play(lease, sequence=1, bouts=3000).accepted
    assert match.report("antagonist", 1, 0).accepted
    assert match.league.health().counters["ledger_failures"] >= 1
    assert match.league.health().last_error == ""
    match.stop()


def test_while_the_disk_is_full_the_ledger_is_read_once_and_not_at_each_try(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    match = Match(tmp_path)
    match.both_start()
    lease = match.lease()
    read: list[int] = []
    replay = Ledger.replay
    monkeypatch.setattr(Ledger, "replay", lambda self: read.append(1) or replay(self))
    room = max(path.stat().st_size for path in tmp_path.rglob("*") if path.is_file())
    with no_room(room):
        assert isinstance(match.play(lease, sequence=1, bouts=3000), Refused)
        for _ in range(10):
            match.clock.advance(1.0)
            match.note(1)
    match.clock.advance(1.0)
    assert match.renew(lease).alive
    assert read == [1]
    match.stop()


@pytest.mark.skipif(os.getuid() != 0, reason="mounting a small disk needs root")
def test_a_league_on_a_small_disk_loses_nothing_it_acknowledged(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    if shutil.which("mount") is None or os.system(f"mount -t tmpfs -o size=1m t {disk}"):
        pytest.skip("mounting a small disk is not allowed here")
    try:
        match = Match(disk)
        match.both_start()
        lease = match.lease()
        acknowledged = 0
        for sequence in range(1, 2000):
            match.clock.advance(0.001)
            answer = match.play(lease, sequence=sequence, bouts=100)
            if isinstance(answer, Refused):
                break
            acknowledged += answer.accepted
        assert isinstance(answer, Refused)
        assert answer.retry
        with open_read_only(disk / "league.sqlite") as ledger:
            assert sum(e.event.kind == "bouts" for e in ledger.replay()) == acknowledged
        match.bus.close()
        match.league.close()
        filling = [incident(number, "x" * 1000) for number in range(2000)]
        with (  # its own log may leave it the room to open, not the room for this
            pytest.raises(LedgerError, match="free space on its disk"),
            contextlib.closing(Ledger(disk / "league.sqlite")) as opened,
        ):
            opened.append(filling, 0)
        assert not os.system(f"mount -o remount,size=4m {disk}")
        match.start()
        assert len(match.league.state.result_names) == acknowledged
        assert match.play(lease, sequence=5000, bouts=100).accepted
        match.stop()
    finally:
        assert not os.system(f"umount {disk}"), "the ledger left a file open"
