"""`riposte play deploy/robot.toml` with a robot, a person, a strap and a room that are not there.

Twenty bouts in a row, armed once by a person: every stream is in the recording at its nominal rate,
the score is what the archived poses give, and what the referee said is what sounded.
"""

import time
from collections.abc import Mapping
from pathlib import Path

import msgspec
import numpy as np
import psutil
import pytest

from services import cli
from shared.runtime.logging import configure_logging
from tests.integration.full_stack.doubles import Lab, lab, lacks
from tests.integration.full_stack.evidence import LOOP, Recorded, recorded, series_drawn
from tests.integration.full_stack.hearing import SHORTEST, Hearing, asked
from tests.integration.play_job.playing import Playing, playing
from tests.integration.training.training import log_of, processes_of

LACKS = lacks()
pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.skipif(bool(LACKS), reason=LACKS),
    pytest.mark.filterwarnings("ignore:RRD file has no footer"),
]

PATIENT = (
    "recorder.live=false", "play.patience=30", "safety.command_hold=0.5", "safety.tracker_hold=0.5",
    "safety.state_hold=0.5", "safety.state_trip=0.5", "safety.command_trip=2.0",
    "pr2.clock_offset=1.0", "referee.stale_after=1.0", "referee.void_after=10.0",
    "policy.stale_after=1.0", "policy.referee_silence=2.0", "robot_io.referee_silence=2.0",
)  # fmt: skip
"""How long something may stay away on a machine of two busy cores, on which the robot, too, is
simulated. No limit on how the arm moves is another than in deploy/robot.toml."""
VOLUME = 0.3
TOO_BUSY = 0.02
"""Share of the loop's ticks; a machine that loses more of them has no rates to speak of."""


@pytest.mark.timeout(240)
def test_a_short_match_on_doubles_is_recorded_scored_and_heard(tmp_path: Path):
    found = check_match(
        tmp_path / "match", "--protagonist", "heuristic", bouts=2, bout_steps=600, rest=1.0
    )
    assert any(one.bout.info.penalty_steps for one in found), "the bats never touched"


@pytest.mark.timeout(1200)
def test_twenty_bouts_in_a_row_on_doubles_are_recorded_scored_and_heard(tmp_path: Path):
    check_match(tmp_path / "match", bouts=20, bout_steps=2000, rest=1.0)


def check_match(
    folder: Path, *players: str, bouts: int, bout_steps: int, rest: float
) -> list[Recorded]:
    """Play a match, armed once by a person, look at all it has left, and return it."""
    words = ("deploy/robot.toml", *players, "--bouts", str(bouts), "--no-browser")
    own = (f"game.bout_steps={bout_steps}", f"play.rest={rest}", f"tones.volume={VOLUME}")
    with lab() as around:
        with playing(
            folder, *words, overrides=(*around.settings, *own, *PATIENT),
            environment=around.environment,
        ) as match:  # fmt: skip
            arm(match)
            code, said = match.finish(60.0 + bouts * (0.015 * bout_steps + rest + 2.0))
        samples, began_at = around.sound.samples(), around.sound.began_at()
        heard = Hearing(samples, began_at + time.time_ns() * 1e-9 - time.monotonic(), VOLUME)
        robot, beats = around.robot.ask(), around.beats
        if code != 0:
            skip_where_busy(match.summary["loop"], said)
        assert code == 0, said
        assert_nothing_is_left(folder, around)
    assert_all_bouts_finished(match, bouts, bout_steps)
    found = recorded(folder)
    report(match, found, robot)
    assert [one.bout.info.outcome for one in found] == ["finished"] * bouts
    assert_scores(match, found)
    assert_nothing_tripped(match, found)
    assert_recorded(found)
    assert_heart(found, beats)
    assert_tones(folder, found, heard)
    assert_rates(found)
    return found


def arm(match: Playing) -> None:
    """Arm the robot as a person does: once, with everything in order."""
    match.until(match.is_endpoint_there)
    match.until(lambda: "robot disarmed" in match.said)
    match.until(lambda: cli.main(["robot", "check", "--run", str(match.folder)]) == 0)
    assert cli.main(["robot", "arm", "--run", str(match.folder)]) == 0
    configure_logging(None)


def skip_where_busy(counters: Mapping[str, float], what: str) -> None:
    """Skip where robot_io itself has counted that this machine did not let it keep time."""
    ticks, lost = counters.get("ticks", 0.0), counters.get("ticks_lost", 0.0)
    if lost > TOO_BUSY * (ticks + lost):
        share = lost / (ticks + lost)
        pytest.skip(f"this machine was too busy, {share:.0%} of the ticks were lost: {what}")


def assert_all_bouts_finished(match: Playing, bouts: int, bout_steps: int) -> None:
    summary = match.summary
    assert [bout["outcome"] for bout in summary["bouts"]] == ["finished"] * bouts, match.said
    for bout in summary["bouts"]:
        assert bout["seconds"] == pytest.approx(0.01 * bout_steps)
        assert bout["antagonist"] == "person"
        assert bout["protagonist"].startswith(("sha256:", "scripted:"))
    assert (summary["link"], summary["ended"], summary["deaths"]) == ("pr2", "", [])


def assert_nothing_is_left(folder: Path, around: Lab) -> None:
    """No process of the match runs on, also none of a child that names no folder."""
    assert processes_of(folder) == []
    mark = around.environment["VR_PATHREG_OVERRIDE"]
    left: list[str] = []
    for process in psutil.process_iter():
        try:
            if process.environ().get("VR_PATHREG_OVERRIDE") == mark:
                left.append(" ".join(process.cmdline()))
        except (psutil.NoSuchProcess, psutil.AccessDenied):
            continue
    assert left == []


def assert_scores(match: Playing, found: list[Recorded]) -> None:
    for one, said in zip(found, match.summary["bouts"], strict=True):
        info = one.bout.info
        assert one.recounted() == (said["score"], info.steps), info.bout
        for name in ("score", "attack_steps", "penalty_steps", "camping_steps", "missed_ticks"):
            assert getattr(info, name) == said[name], (info.bout, name)


def assert_nothing_tripped(match: Playing, found: list[Recorded]) -> None:
    assert match.summary["loop"]["trips"] == 0
    asked_of_gate = [
        (event["action"], event["reasons"])
        for event in log_of(match.folder, "robot-io-0")
        if event["event"] == "gate_asked" and event["action"] != "check"
    ]
    assert asked_of_gate == [("arm", []), ("disarm", [])]
    for one in found:
        gate, robot = one.within("gate"), one.within("robot")
        assert set(gate["mode"].tolist()) <= {"armed", "holding"}
        assert gate["is_sent"].sum() > 0.5 * len(gate)
        for name in ("speed", "force", "effort_share", "efforts"):
            assert np.isfinite(robot[name]).all(), name
        assert not robot["is_run_stopped"].any()
        assert not robot["are_motors_halted"].any()
        assert np.ptp(one.within("bats")["protagonist_position"], axis=0).max() > 0.02


def assert_recorded(found: list[Recorded]) -> None:
    """Every row that was archived is drawn in the .rrd too, at its time."""
    for one in found:
        for series in series_drawn():
            times = np.sort(one.within(series.stream)["t_ns"])
            assert len(times) > 0, series.path
            np.testing.assert_array_equal(one.drawn[series.path], times, series.path)
        assert {"bats", *LOOP, "referee", "heart_rate"} <= set(one.bout.streams)
        assert not any(info.dropped for info in one.bout.info.streams.values())


def assert_heart(found: list[Recorded], beats: int) -> None:
    """A beat a second; what the strap sent between the first and the last bout is all there."""
    every = np.unique(np.concatenate([one.bout.streams["heart_rate"]["t_ns"] for one in found]))
    assert len(every) <= beats
    for one in found:
        assert len(one.drawn["bout/heart_rate"]) == pytest.approx(one.seconds, abs=2.0)
        rates = one.bout.streams["heart_rate"]["beats_per_minute"]
        assert set(rates.tolist()) <= set(np.arange(130.0, 140.0).tolist())


def assert_tones(folder: Path, found: list[Recorded], heard: Hearing) -> None:
    """What the referee asked for sounded, and nothing else did."""
    tones = [tone for one in found for tone in asked(one.bout)]
    long = [tone for tone in tones if tone.end - tone.begin >= SHORTEST]
    silent = [tone for tone in long if not heard.hears(tone)]
    lengths = {
        f"{hz:.0f} Hz": sum(t.end - t.begin for t in tones if t.hz == hz) for hz in heard.heard
    }
    unasked = heard.unasked(tones)
    note(folder, asked=len(long), silent=len(silent), seconds=lengths, unasked_seconds=unasked)
    assert lengths["440 Hz"] > 0.5, "nobody scored"
    assert len(silent) <= 0.1 * len(long)
    assert unasked <= 0.05 * sum(lengths.values())


def assert_rates(found: list[Recorded]) -> None:
    """A hundred ticks a second, and in all streams of the loop a row for each that it made."""
    for one in found:
        whole, lost = one.ticks()
        assert whole / one.seconds == pytest.approx(100.0, rel=0.03)
        made = whole - lost
        for name in LOOP:
            if name != "protagonist_offsets":
                rows = len(one.within(name))  # some have times of their own, a little before
                assert rows == pytest.approx(made, abs=max(3.0, 0.005 * made)), name
        rows = one.within("referee")
        judged = rows["tick"][rows["phase"] == "running"]
        missed = one.bout.info.missed_ticks
        assert len(judged) + missed == pytest.approx(one.bout.info.steps, abs=2)
    skip_where_busy(found[-1].loop_counters(), "the rates were not looked at")
    for one in found:
        for series in series_drawn():
            nominal = 1.0 if series.stream == "heart_rate" else 100.0
            least = 0.9 if series.stream in ("protagonist_offsets", "heart_rate") else 0.95
            rate = one.rate(series.path)
            assert least * nominal <= rate <= 1.1 * nominal, (one.bout.info.bout, series.path)


def report(match: Playing, found: list[Recorded], robot: str) -> None:
    """Note how fast and how late everything was."""
    paths = {series.stream: series.path for series in series_drawn()}
    rates = {
        stream: round(float(np.mean([one.rate(path) for one in found])), 2)
        for stream, path in paths.items()
    }
    gate = {
        name: np.concatenate([one.within("gate")[name] for one in found])
        for name in ("lateness_ms", "answer_ms")
    }
    times = {
        name: [round(float(np.nanpercentile(values, q)), 2) for q in (50, 99, 100)]
        for name, values in gate.items()
    }
    whole, lost = np.sum([one.ticks() for one in found], axis=0)
    note(
        match.folder, rates_hz=rates, p50_p99_max=times, ticks=int(whole), lost=int(lost),
        scores=[bout["score"] for bout in match.summary["bouts"]],
        touches=[bout["penalty_steps"] for bout in match.summary["bouts"]],
        loop=match.summary["loop"], robot=robot,
    )  # fmt: skip


def note(folder: Path, **what: object) -> None:
    """Write down beside the match what people want to know of it."""
    with folder.with_suffix(".jsonl").open("ab") as file:
        file.write(msgspec.json.encode(what) + b"\n")
