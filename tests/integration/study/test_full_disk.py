"""A disk that fills up while a session goes on: a clear error, and nothing of before is lost."""

import itertools

import pytest

from shared.clock import ManualClock
from shared.errors import RiposteError
from shared.runtime.files import atomic_write
from shared.study.checking import study_remarks
from shared.study.events import Noted, SessionBegan
from shared.study.folder import open_study
from shared.study.journal import Journal, read_journal
from shared.study.recorded import refresh, write_session
from shared.study.rows import HeartRateRow
from shared.study.tsv import RowLog, read_table
from shared.study.withdrawal import withdraw
from tests.integration.disks import fill, small_disk
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
