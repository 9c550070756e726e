"""A disk that fills up while a session goes on: a clear error, and nothing of before is lost."""

import itertools
import sys
import threading
import time
from types import SimpleNamespace

import pytest
from rich.console import Console

from services.jobs.play.command import Course
from services.jobs.play.plan import parse, plan_of
from services.supervisor import ProcessSpec, Supervisor
from shared.clock import ManualClock, SystemClock
from shared.errors import RiposteError
from shared.runtime.files import atomic_write
from shared.study.checking import study_remarks
from shared.study.events import Noted, SessionBegan
from shared.study.folder import open_study
from shared.study.journal import Journal, read_journal
from shared.study.progress import replay
from shared.study.recorded import refresh, write_session
from shared.study.rows import HeartRateRow
from shared.study.tsv import RowLog, read_table
from shared.study.withdrawal import withdraw
from tests.integration.disks import fill, small_disk
from tests.integration.study.running import People, events_of, make, running
from tests.unit.study.made import AT, play, study_in

CLOCK = ManualClock(AT + 10_000.0)


def beat(number):
    return HeartRateRow(
        participant="sub-01", session=1, t_ns=number, wall="w", bpm=80.0 + number, contact=True,
        step="s1-g01", section=1, condition="A", game=1, attempt=1, source="strap", policy="p",
        config="c",
    )  # fmt: skip


def write_for_ever(write):
    for number in itertools.count(2):
        write(number)


def test_a_journal_on_a_full_disk_keeps_what_it_has_and_goes_on_when_there_is_room(tmp_path):
    with small_disk(tmp_path, 1) as disk:
        study = study_in(disk / "s")
        folder = study.session_folder("sub-01")
        began = SessionBegan(
            participant="sub-01", session=1, order=study.labels_of("sub-01"), study="s",
            protocol=study.protocol_hash, config="c", commit="", version="1",
        )  # fmt: skip
        with Journal(folder, CLOCK) as journal, RowLog(folder / "hr.tsv", HeartRateRow) as heart:
            journal.write(began)
            heart.write(beat(1))
            fill(disk / "ballast")
            with pytest.raises(RiposteError, match=r"no space left to write .*journal"):
                write_for_ever(lambda number: journal.write(Noted(text="x" * 500)))
            with pytest.raises(RiposteError, match=r"no space left to write .*hr"):
                write_for_ever(lambda number: heart.write(beat(number)))
            kept = read_table(folder / "hr.tsv", HeartRateRow)
            assert kept == [beat(number) for number in range(1, len(kept) + 1)]
            assert read_journal(folder) == journal.events
            written = len(journal.events)
            (disk / "ballast").unlink()
            journal.write(Noted(text="there is room again"))
            heart.write(beat(len(kept) + 1))
        after = read_journal(folder)
        assert [event.number for event in after] == list(range(1, written + 2))
        assert after[-1].what == Noted(text="there is room again")
        assert len(read_table(folder / "hr.tsv", HeartRateRow)) == len(kept) + 1


def test_tables_on_a_full_disk_stay_as_they_were_and_are_made_again_from_the_journal(tmp_path):
    with small_disk(tmp_path, 1) as disk:
        study = study_in(disk / "s")
        play(study, "sub-01")
        folder = study.session_folder("sub-01")
        before = {path: path.read_bytes() for path in folder.glob("*.tsv")}
        with Journal(folder, CLOCK) as journal:
            journal.write(Noted(text="after the end"))
        fill(disk / "ballast")
        with pytest.raises(RiposteError, match="no space left"):
            write_session(study, "sub-01")
        assert {path: path.read_bytes() for path in folder.glob("*.tsv")} == before
        (disk / "ballast").unlink()
        refresh(study)
        events = folder / "events.tsv"
        assert events.read_bytes().count(b"\n") == before[events].count(b"\n") + 1


def test_who_withdraws_is_deleted_from_a_full_disk(tmp_path):
    with small_disk(tmp_path, 1) as disk:
        study = study_in(disk / "s")
        play(study, "sub-01")
        atomic_write(study.session_folder("sub-01") / "recording.rrd", bytes(100_000))
        fill(disk / "ballast")
        withdraw(study.folder, "sub-01", CLOCK)  # what is deleted makes the room for the line
        assert not (study.folder / "sub-01").exists()
        assert [each.participant for each in open_study(study.folder).assignments] == [
            "sub-02", "sub-03", "sub-04",
        ]  # fmt: skip


def test_a_disk_that_will_not_hold_the_study_is_noticed_before_it_begins(tmp_path):
    with small_disk(tmp_path, 1) as disk:
        study = study_in(disk / "s", people=4)
        notes = [remark.text for remark in study_remarks(study) if remark.level == "note"]
        # 4 people, 9 games of 20 s each, 0.25 MB/s.
        assert [note for note in notes if note.startswith("4 people who have not played need")]


@pytest.mark.zenoh
@pytest.mark.slow
@pytest.mark.timeout(400)
def test_a_run_whose_disk_fills_up_ends_with_one_line_and_goes_on_when_there_is_room(tmp_path):
    with small_disk(tmp_path, 300) as disk:
        (disk / "study").mkdir()
        (tmp_path / "study").symlink_to(disk / "study")  # what the command says is elsewhere
        study = make(tmp_path / "study")
        people = People(study.session_folder("sub-01"))
        with running(study, "sub-01") as run:
            people.until(lambda: "baseline-walking" in progress_of(study).done, run, 150.0)
            fill(disk / "ballast")
            before = events_of(study)
            deadline = time.monotonic() + 60.0
            while run.process.poll() is None:  # what fits beside the last line is still written
                people.tick()
                assert time.monotonic() < deadline, run.said
                time.sleep(0.02)
            code, said = run.finish()
        assert code == 2, said
        last = said.splitlines()[-1]
        assert last.startswith("riposte: study: ")
        assert "no space left" in last, said
        assert "Traceback" not in said
        kept = events_of(study)
        assert kept[: len(before)] == before
        (disk / "ballast").unlink()
        with running(study, "sub-01") as run:
            people.until(lambda: progress_of(study).state == "ended", run, 120.0)
            code, said = run.finish()
        people.close()
        assert code == 0, said
        events = events_of(study)
        assert events[: len(kept)] == kept
        assert [event.number for event in events] == list(range(1, len(events) + 1))


def test_a_process_whose_last_words_found_no_room_is_said_to_have_had_none(tmp_path):
    with small_disk(tmp_path, 1) as disk:
        words = ["--antagonist", "scripted:stab", "--protagonist", "scripted:guard"]
        plan = plan_of(parse([*words, "--out", str(disk / "run")]))
        course = Course(plan, Console(), threading.Event(), browser=False)
        silent = ProcessSpec("study-0", (sys.executable, "-c", "raise SystemExit(2)"))
        supervisor = Supervisor([silent], disk / "run" / "logs", SystemClock())
        supervisor.start()
        fill(disk / "ballast")
        said = []
        try:
            with pytest.raises(RiposteError, match=r"no space left: .*run has 0 MiB free"):
                watch(course, supervisor, SimpleNamespace(say=said.append))
        finally:
            supervisor.stop()
    assert said == ["study-0 died (exit code 2)"]


def watch(course, supervisor, screen, seconds=30.0):
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        course._watch(supervisor, None, screen)
        time.sleep(0.02)


def progress_of(study):
    return replay(events_of(study))
