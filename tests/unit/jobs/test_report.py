import math
import sqlite3
from pathlib import Path

import msgspec
import numpy as np
import pytest

from services.jobs import commands
from services.jobs.report import command as report
from services.jobs.report.command import write_report
from services.jobs.report.pictures import Moment, caption, choose
from services.jobs.report.summarise import bins
from services.jobs.report.summary import Score, Summary
from services.jobs.report.words import (
    clock_text,
    duration_text,
    headline,
    points_text,
    summary_text,
)
from services.league.history import CurvePoint
from shared.errors import ConfigError, LedgerError
from tests.unit.jobs.ledgers import BOUTS, SAMPLES, UPDATES, empty_run, finished_run, stopped_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a finished run with its report; not to be changed."""
    folder = finished_run(tmp_path_factory.mktemp("run"))
    write_report(folder, pictures=False)
    return folder


@pytest.fixture(scope="module")
def summary(run: Path) -> Summary:
    return msgspec.json.decode((run / "summary.json").read_bytes(), type=Summary)


def test_the_summary_holds_the_ledgers_numbers(summary: Summary) -> None:
    assert summary.finished
    assert summary.seed == 7
    assert summary.samples == 4 * UPDATES * SAMPLES
    assert [stage.agent for stage in summary.stages] == ["antagonist", "protagonist"] * 2
    assert [stage.complete_bouts for stage in summary.stages] == [UPDATES * BOUTS] * 4
    assert [stage.opponent for stage in summary.stages] == [
        "untrained protagonist", "antagonist 1", "protagonist 1", "antagonist 2",
    ]  # fmt: skip
    assert len(summary.meetings) == 6
    by_names = {(m.antagonist, m.protagonist): m for m in summary.meetings}
    met = by_names["antagonist 1", "static"]
    assert met.score is not None
    assert met.score.mean == pytest.approx(1780, abs=60)
    assert met.score.low < met.score.mean < met.score.high
    assert summary.incident_counts == {"process_restarted": 1}
    assert summary.repeated_rollouts == 0


def test_the_two_differences_of_the_goal_are_found(summary: Summary) -> None:
    lowers, recovers = summary.headline_differences
    assert (lowers.kind, lowers.iteration, lowers.met) == ("lowers", 1, True)
    assert (recovers.kind, recovers.iteration, recovers.met) == ("recovers", 1, True)
    assert lowers.score.mean == pytest.approx(1780 + 250, abs=80)
    assert recovers.score.mean == pytest.approx(1080 + 250, abs=80)
    assert "goal met" in headline(summary)


def test_training_that_made_things_worse_is_said_in_plain_words(tmp_path: Path) -> None:
    summary = write_report(finished_run(tmp_path), pictures=False)
    worse = [
        msgspec.structs.replace(
            d, met=False, score=Score(mean=-900, low=-1000, high=-800, bouts=64)
        )
        for d in summary.headline_differences
    ]

    text = headline(msgspec.structs.replace(summary, headline_differences=tuple(worse)))

    assert "protagonist 1 gives 900 points a bout more to the antagonist" in text
    assert "antagonist 2 loses 900 points a bout more against protagonist 1" in text
    assert "short of 1,500" in text


def test_points_by_rule_add_up_to_the_score(summary: Summary) -> None:
    for meeting in summary.meetings:
        assert meeting.score is not None
        given = meeting.attack_points + meeting.penalty_points + meeting.camping_points
        if meeting.score.mean > 500:  # below, the script's attack steps are cut off at none
            assert given == pytest.approx(meeting.score.mean, abs=1.0)
        assert 0.0 <= meeting.camping_share < 0.2


def test_the_summary_file_is_the_summary(tmp_path: Path) -> None:
    summary = write_report(finished_run(tmp_path), pictures=False)

    text = (tmp_path / "summary.json").read_bytes()
    assert msgspec.json.decode(text, type=Summary) == summary


def test_a_second_report_has_the_same_numbers_and_the_first_ones_origin(tmp_path: Path) -> None:
    commands.note(finished_run(tmp_path), ["train", "--seed", "7"])
    first = write_report(tmp_path, pictures=False)
    page = (tmp_path / "report.html").read_bytes()

    second = write_report(tmp_path, pictures=False)

    assert second == first
    assert second.origin.command == "riposte train --seed 7"
    # The first page could not yet list itself among the files.
    assert len((tmp_path / "report.html").read_bytes()) == pytest.approx(len(page), abs=400)


def test_the_page_says_what_happened_and_escapes_it(run: Path) -> None:
    page = (run / "report.html").read_text()
    assert "actor-0 &lt;killed by signal 9&gt; &amp; started again" in page
    assert "1 x process restarted" in page
    assert "antagonist learns (2)" in page
    assert "[league]" in page


def test_a_quiet_run_says_so(tmp_path: Path) -> None:
    summary = write_report(finished_run(tmp_path, incidents=False), pictures=False)

    assert "no process was restarted" in (tmp_path / "report.html").read_text()
    assert "nothing out of the ordinary" in summary_text(summary)


def test_a_stopped_run_has_a_report_of_what_there_is(tmp_path: Path) -> None:
    summary = write_report(stopped_run(tmp_path), pictures=False)

    assert not summary.finished
    assert "in stage 2, protagonist at update 13 of 40" in headline(summary)
    assert summary.differences == ()
    assert "No evaluation has been played yet" in (tmp_path / "report.html").read_text()


def test_a_run_that_has_just_begun_has_a_report(tmp_path: Path) -> None:
    summary = write_report(empty_run(tmp_path))

    assert "no stage has begun" in summary_text(summary)
    assert (tmp_path / "report.html").exists()


def test_the_text_fits_on_one_screen(summary: Summary) -> None:
    lines = summary_text(summary).splitlines()

    assert len(lines) <= 30
    assert max(len(line) for line in lines) <= 120


def test_a_folder_without_a_run_is_refused_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"holds no run \(no league.sqlite\)"):
        write_report(tmp_path)


def test_a_ledger_of_another_program_is_refused(tmp_path: Path) -> None:
    with sqlite3.connect(tmp_path / "league.sqlite") as other:
        other.execute("CREATE TABLE notes (text)")

    with pytest.raises(LedgerError, match="another program"):
        write_report(tmp_path)


def test_the_command_prints_the_summary_as_json(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    finished_run(tmp_path)

    assert report.main([str(tmp_path), "--no-pictures", "--json"]) == 0

    printed = msgspec.json.decode(capsys.readouterr().out, type=Summary)
    assert printed.run == "quick"


def test_bins_keep_every_bout_and_their_order() -> None:
    points = [
        CurvePoint(update=k, total_samples=k, at_ns=k, score=[float(k)] * (1 + k % 5))
        for k in range(400)
    ]

    found = bins(points)

    flat = [point for part in found for point in part]
    assert flat == points
    assert len(found) <= 41
    assert all(sum(len(point.score) for point in part) >= 12 for part in found)
    assert bins([]) == []


@pytest.mark.parametrize(
    ("seconds", "short", "words"),
    [(0, "0:00", "0 s"), (61.4, "1:01", "1 min 1 s"), (7384, "2:03:04", "2 h 3 min")],
)
def test_durations_read_well(seconds: float, short: str, words: str) -> None:
    assert clock_text(seconds) == short
    assert duration_text(seconds) == words


def test_points_have_a_sign_and_a_proper_minus() -> None:
    assert points_text(1234.4) == "+1,234"
    assert points_text(-1234.6) == "\N{MINUS SIGN}1,235"
    assert points_text(-0.2) == "0"
    assert points_text(1234.4, sign=False) == "1,234"


def moment(step: int, *, own: bool = False, other: bool = False, contact: bool = False) -> Moment:
    return Moment(
        step=step, qpos=np.zeros(14), positions=np.zeros((1, 3), np.float32),
        blades=np.zeros((2, 2, 3)), in_target=(own, other), contact=contact, score=0.0,
    )  # fmt: skip


def test_pictures_show_what_the_game_is_about() -> None:
    moments = [
        moment(10 * k, own=20 <= k < 60, contact=k == 150, other=k > 160) for k in range(1, 200)
    ]

    found = choose(moments)

    assert [m.step for m in found] == sorted(m.step for m in found)
    assert len(found) == 3
    assert "scores" in caption(found[0], 0.01)
    assert any(m.contact for m in found)
    assert any(m.in_target[1] for m in found)
    assert min(abs(a.step - b.step) for a in found for b in found if a is not b) >= 100


def test_pictures_of_an_uneventful_bout_are_spread_out() -> None:
    found = choose([moment(10 * k) for k in range(1, 200)])

    assert len(found) == 3
    assert math.isclose(found[0].step, 100)
    assert found[-1].step == 1990
