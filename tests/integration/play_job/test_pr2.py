"""`riposte play` with a PR2, a fake one on a real ROS master: nobody's typing arms it."""

import contextlib
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from services import cli
from shared.runtime.logging import configure_logging
from shared.testing.ros_master import has_ros_master
from tests.integration.play_job.playing import QUICK, onlooking, playing
from tests.integration.training.training import ROOT, log_of, processes_of

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.skipif(
        not has_ros_master(), reason="needs Debian's ROS master: apt install python3-rosmaster"
    ),
]
PATIENT = (
    *QUICK, "play.rest=1.0", "game.bout_steps=150", "safety.state_trip=0.5", "pr2.clock_offset=0.5",
    "safety.command_trip=2.0",
)  # fmt: skip
"""The machine is busy, and the fake robot is simulated on it too."""


@pytest.fixture(autouse=True)
def _own_log() -> Iterator[None]:
    yield
    configure_logging(None)


@contextlib.contextmanager
def fake_pr2() -> Iterator[str]:
    """Run a PR2 that is none, set up; yield the address of its master."""
    process = subprocess.Popen(
        [sys.executable, "-m", "shared.testing.fake_pr2", "--port", "0", "--set-up"],
        cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    try:
        yield process.stdout.readline().strip().partition("=")[2]
    finally:
        process.communicate("quit\n", timeout=30)


def a_bat(folder: Path) -> Path:
    """Write a recorded bat that is held still, en garde."""
    rows = np.zeros((2, 14))
    rows[:, 0] = (0.0, 10.0)
    rows[:, 1:5] = (0.75, 0.2, 1.3, 1.0)
    np.save(folder / "bat.npy", rows)
    return folder / "bat.npy"


def test_a_pr2_plays_when_somebody_has_armed_it_and_not_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    folder, site = tmp_path / "match", tmp_path / "site.toml"
    with fake_pr2() as master:
        site.write_text(
            f'[robot_io]\nlink = "pr2"\ntracker = "replay"\nreplay = "{a_bat(tmp_path)}"\n'
            f'[pr2]\nmaster_uri = "{master}"\n[play]\nbouts = 2\nprotagonist = "heuristic"\n'
        )
        with (
            playing(folder, str(site), "--no-browser", overrides=PATIENT) as match,
            onlooking(match) as onlooker,
        ):
            onlooker.until(lambda: onlooker.mode == "disarmed" and len(onlooker.states) > 20)
            onlooker.rest(3.0)
            assert not any(gate.is_sent for gate in onlooker.gates)
            assert onlooker.phase in ("", "ready")

            match.until(lambda: cli.main(["robot", "check", "--run", str(folder)]) == 0)
            out = capsys.readouterr().out
            assert "✓ r_cart runs, alone on the arm" in out
            assert "✓ the power board answers, the right arm has power" in out
            match.until(lambda: cli.main(["robot", "arm", "--run", str(folder)]) == 0)
            onlooker.until(lambda: any(gate.is_sent for gate in onlooker.gates))
            code, said = match.finish(90.0)
    assert code == 0, said
    assert match.summary["link"] == "pr2"
    assert processes_of(folder) == []
    asked = [event for event in log_of(folder, "robot-io-0") if event["event"] == "gate_asked"]
    arms = [event for event in asked if event["action"] == "arm" and not event["reasons"]]
    assert len(arms) == 1
    assert "riposte play" not in arms[0]["operator"]
