"""What the words of `riposte study run` ask for, and what is refused before anything starts."""

import socket
from pathlib import Path

import pytest

from services.jobs.play.plan import Plan
from services.jobs.play.processes import processes
from services.jobs.study.hosting import StudyHost
from services.jobs.study.run import main, parse, plan_of, progress_of
from services.study.config import StudyConfig
from shared.bus.ports import free_port
from shared.clock import Clock, ManualClock, SystemClock
from shared.config.site import load_section
from shared.errors import ConfigError, RiposteError, SnapshotError, StudyError
from shared.runtime.files import RunLock
from shared.study.drawing import draw_orders
from shared.study.events import SessionBegan, SessionEnded
from shared.study.folder import Study, make_study
from shared.study.instants import text_of
from shared.study.journal import Journal, last_event, read_journal
from tests.unit.study.runner_stand import AT, SHORT


def study_in(folder: Path, text: str = SHORT, clock: Clock | None = None) -> Study:
    clock = ManualClock(AT) if clock is None else clock
    make_study(folder, text.encode(), "short.toml", "1.0", clock)
    return draw_orders(folder, 4, 1, clock)


def planned(study: Study, *words: str) -> Plan:
    return plan_of(study, parse([str(study.folder), "--participant", "sub-02", *words]))


def test_a_session_has_its_own_folder_its_players_and_nobody_is_named_to_it(tmp_path: Path):
    study = study_in(tmp_path / "study")
    plan = planned(study, "--antagonist", "mouse")
    assert plan.folder == study.folder / "sub-02" / "ses-01"
    assert plan.run == "short-sub-02-ses-01"
    path = tmp_path / "config.toml"
    path.write_text(plan.settings)
    cfg = load_section(path, "study", StudyConfig)
    assert cfg.participant == "sub-02"
    assert dict(cfg.players) == {
        "scripted:guard": "scripted:guard", "scripted:heuristic": "scripted:heuristic",
    }  # fmt: skip
    assert (cfg.antagonist, cfg.needs_recorder) == ("person", True)
    assert not cfg.has_heart_rate  # heart_rate.source is "none" on a laptop
    assert plan.protagonist.reference == "scripted:static"
    assert not plan.folder.exists()


def test_a_session_with_a_strap_waits_for_its_heart_rate(tmp_path: Path):
    plan = planned(study_in(tmp_path / "study"), "--set", "heart_rate.source=ble")
    path = tmp_path / "config.toml"
    path.write_text(plan.settings)
    assert load_section(path, "study", StudyConfig).has_heart_rate


@pytest.mark.parametrize(("antagonist", "has_page"), [("mouse", True), ("scripted:stab", False)])
def test_it_starts_what_a_match_starts_and_the_study_last(
    tmp_path: Path, antagonist: str, has_page: bool
):
    plan = planned(study_in(tmp_path / "study"), "--antagonist", antagonist)
    host = StudyHost(plan, "A study", "sub-02", clock=ManualClock(1.0))
    made = processes(plan, "tcp/127.0.0.1:7447")
    names = [spec.name for spec in host.processes(made, "tcp/127.0.0.1:7447")]
    assert names[-1] == "study-0"
    assert ("page-0" in names) == has_page
    assert {"router-0", "recorder-0", "robot-io-0", "policy-protagonist", "referee-0"} <= set(names)
    assert host.title == "study: A study, sub-02"
    assert not host.is_over


def test_who_has_played_does_not_play_again(tmp_path: Path):
    study = study_in(tmp_path / "study")
    clock = ManualClock(AT)
    began = SessionBegan(
        participant="sub-02", session=1, order=("A", "B"), study="short", protocol="p",
        config="c", commit="", version="",
    )  # fmt: skip
    with Journal(study.session_folder("sub-02"), clock) as journal:
        journal.write(began)
        assert progress_of(study, "sub-02", clock).state == "going"
        clock.advance(60.0)
        journal.write(SessionEnded())
    with pytest.raises(StudyError, match="sub-02 has played already"):
        progress_of(study, "sub-02", clock)
    assert progress_of(study, "sub-01", clock).state == "new"


def test_a_clock_that_is_wrong_is_said_before_anything_starts(tmp_path: Path):
    study = study_in(tmp_path / "study")
    with pytest.raises(StudyError, match="clock of this machine"):
        progress_of(study, "sub-01", ManualClock(1000.0))


DAY = 86400.0


def days_ago(days: float) -> ManualClock:
    return ManualClock(SystemClock().wall_ns() / 1e9 - days * DAY)


def run_elsewhere(study: Study, *words: str) -> None:
    """Say `study run` of somebody whose session another process has."""
    argv = [str(study.folder), "--participant", "sub-02", "--antagonist", "scripted:stab", *words]
    with RunLock(study.session_folder("sub-02") / "logs"):
        main(argv)


def begin(study: Study, participant: str, clock: Clock) -> None:
    with Journal(study.session_folder(participant), clock) as journal:
        journal.write(SessionBegan(
            participant=participant, session=1, order=study.labels_of(participant), study="short",
            protocol=study.protocol_hash, config="c", commit="", version="",
        ))  # fmt: skip


@pytest.mark.parametrize("days", [0.0, 180.0])
def test_a_study_that_rested_for_half_a_year_goes_on(tmp_path: Path, days: float):
    study = study_in(tmp_path / "study", clock=days_ago(days))
    begin(study, "sub-01", days_ago(days))
    with pytest.raises(RiposteError, match="in use by process"):
        run_elsewhere(study)


@pytest.mark.parametrize(
    ("days", "words"),
    [
        (
            -0.125,
            r"shows 2.*, 3\.0 h before the last event of sub-01 \(2.*\), expected a later time",
        ),
        (
            500.0,
            r"shows 2.*, 500 days after the last event of sub-01 \(2.*\), expected at most 366",
        ),
    ],
)
def test_a_clock_that_other_sessions_speak_against_is_refused_until_a_person_says_otherwise(
    tmp_path: Path, days: float, words: str
):
    study = study_in(tmp_path / "study", clock=days_ago(600.0))
    begin(study, "sub-01", days_ago(days))
    with pytest.raises(StudyError, match=words + r".*timedatectl.*--clock-is-right"):
        run_elsewhere(study)
    with pytest.raises(RiposteError, match="in use by process"):
        run_elsewhere(study, "--clock-is-right")


@pytest.mark.parametrize(("days", "words"), [(-3.0, "before"), (400.0, "after")])
def test_a_clock_that_a_line_of_changes_speaks_against_is_refused(
    tmp_path: Path, days: float, words: str
):
    study = study_in(tmp_path / "study", clock=days_ago(390.0))
    day = text_of(days_ago(days).wall_ns())[:10]
    with (study.folder / "CHANGES").open("a") as file:
        file.write(f"{day} looked through\nand nothing was found\n")
    with pytest.raises(StudyError, match=f"{words} the last line of CHANGES .{day}"):
        run_elsewhere(study)


def test_a_journal_that_cannot_be_read_says_nothing_of_the_clock(tmp_path: Path):
    study = study_in(tmp_path / "study")
    begin(study, "sub-01", ManualClock(AT))
    path = study.session_folder("sub-01") / "journal.jsonl"
    assert last_event(path.parent) == read_journal(path.parent)[-1]
    with path.open("ab") as file:
        file.write(b'{"number": 2')
    assert last_event(path.parent) == read_journal(path.parent)[-1]
    path.write_bytes(b"no event\n")
    assert progress_of(study, "sub-02", ManualClock(AT)).state == "new"
    assert last_event(tmp_path) is None


def test_somebody_who_is_not_expected_is_refused(tmp_path: Path):
    study = study_in(tmp_path / "study")
    with pytest.raises(StudyError, match=r"'sub-09' is not in .*it has sub-01 to sub-04"):
        progress_of(study, "sub-09", ManualClock(AT))


def test_a_player_that_is_not_there_is_said_with_its_place(tmp_path: Path):
    text = SHORT.replace('player = "scripted:heuristic"', 'player = "style-99"')
    study = study_in(tmp_path / "study", text)
    with pytest.raises(SnapshotError, match="condition 'hard': player 'style-99'"):
        planned(study)


def test_a_port_that_was_asked_for_and_is_taken_is_refused(tmp_path: Path):
    study = study_in(tmp_path / "study")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", free_port()))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ConfigError, match=rf"study.port: {port} is in use"):
            planned(study, "--port", str(port))


def test_a_session_that_runs_elsewhere_is_not_run_again(tmp_path: Path):
    study = study_in(tmp_path / "study", clock=SystemClock())
    folder = study.session_folder("sub-01")
    words = [str(study.folder), "--participant", "sub-01", "--antagonist", "scripted:stab"]
    with RunLock(folder / "logs"), pytest.raises(RiposteError, match="in use by process"):
        main(words)
    assert not (folder / "journal.jsonl").exists()
    assert not (folder / "config.toml").exists()
