"""Withdrawal: everything of the participant is deleted, also when it was interrupted."""

import shutil

import pytest

from shared.clock import ManualClock
from shared.errors import RiposteError, StudyError
from shared.study.drawing import draw_orders
from shared.study.folder import open_study
from shared.study.journal import Journal
from shared.study.tables import load_study
from shared.study.withdrawal import LINE, withdraw
from tests.unit.study.made import AT, play, study_in

CLOCK = ManualClock(AT + 10_000.0)


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    study = study_in(tmp_path_factory.mktemp("original") / "s")
    play(study, "sub-02")
    play(study, "sub-04")
    return study


@pytest.fixture
def folder(original, tmp_path):
    shutil.copytree(original.folder, tmp_path / "s")
    return tmp_path / "s"


def mentions(folder, participant):
    return [
        path for path in folder.rglob("*")
        if participant in str(path.relative_to(folder))
        or (path.is_file() and participant.encode() in path.read_bytes())
    ]  # fmt: skip


def test_nothing_of_them_is_left_but_a_line_that_says_that_somebody_withdrew(folder):
    before = load_study(folder).games["participant"]
    assert mentions(folder, "sub-04")
    assert withdraw(folder, "sub-04", CLOCK) == ()
    assert mentions(folder, "sub-04") == []
    assert (folder / "CHANGES").read_text().splitlines()[-1] == f"2027-01-15 {LINE}"
    after = load_study(folder)
    assert after.games["participant"] == [name for name in before if name != "sub-04"]
    assert after.participants["participant"] == ["sub-02"]


def test_their_number_is_given_to_nobody_else(folder):
    withdraw(folder, "sub-04", CLOCK)
    study = draw_orders(folder, 5, 7, CLOCK)
    names = [each.participant for each in study.assignments]
    assert names == ["sub-01", "sub-02", "sub-03", "sub-05"]


def test_who_never_came_can_withdraw_and_who_withdrew_is_not_there(folder):
    withdraw(folder, "sub-01", CLOCK)
    with pytest.raises(StudyError, match="nothing of sub-01"):
        withdraw(folder, "sub-01", CLOCK)
    with pytest.raises(StudyError, match="names of people"):
        withdraw(folder, "../s", CLOCK)


def test_a_session_that_goes_on_is_not_deleted(folder):
    session = open_study(folder).session_folder("sub-02")
    with Journal(session, CLOCK), pytest.raises(RiposteError, match="in use by process"):
        withdraw(folder, "sub-02", CLOCK)
    assert (session / "journal.jsonl").stat().st_size > 0
    withdraw(folder, "sub-02", CLOCK)
    assert not session.exists()


def test_a_withdrawal_that_was_interrupted_is_finished_by_saying_it_again(folder):
    (folder / "sub-02").rename(folder / ".withdrawn-sub-02")
    withdraw(folder, "sub-02", CLOCK)
    assert mentions(folder, "sub-02") == []


def test_a_damaged_table_keeps_no_recordings(folder):
    (folder / "participants.tsv").write_text("nonsense\n")
    with pytest.raises(StudyError, match=r"participants\.tsv:1"):
        withdraw(folder, "sub-02", CLOCK)
    assert not (folder / "sub-02").exists()


def test_what_was_made_of_their_data_before_is_named(folder):
    (folder / "report.html").write_text("figures of everybody")
    assert withdraw(folder, "sub-02", CLOCK) == (folder / "report.html",)
