"""kill -9 of what a moving robot depends on: it stops, that is said, and nobody moves it again."""

import signal
from pathlib import Path

import pytest

from services import cli
from tests.integration.play_job.playing import Onlooker, onlooking, playing
from tests.integration.training.training import processes_of

pytestmark = [pytest.mark.chaos, pytest.mark.zenoh, pytest.mark.timeout(300)]

STOPPED = ("disarmed", "tripped")


def help_up(folder: Path, onlooker: Onlooker) -> None:
    """Be the person where the machine was too busy for a robot to begin with."""
    if onlooker.mode == "tripped":
        for action in ("reset", "arm"):
            cli.main(["robot", action, "--run", str(folder)])


@pytest.mark.parametrize(
    "victim", ["policy-protagonist", "policy-antagonist", "referee-0", "robot-io-0", "router-0"]
)
def test_the_robot_stops_and_moves_again_only_when_it_is_armed(
    tmp_path: Path, victim: str, capsys: pytest.CaptureFixture[str]
):
    folder = tmp_path / "match"
    players = ("--antagonist", "scripted:slash", "--protagonist", "heuristic")
    with playing(folder, *players) as match, onlooking(match) as onlooker:
        onlooker.until(lambda: onlooker.is_fencing() or help_up(folder, onlooker))
        boot = onlooker.states[-1].boot
        bouts = {state.bout for state in onlooker.referee}
        count = len(onlooker.gates)

        match.kill(victim)
        onlooker.until(lambda: f"{victim} died (killed by SIGKILL)" in match.said)
        onlooker.until(lambda: len(onlooker.gates) > count + 20 and onlooker.mode in STOPPED)
        onlooker.until(lambda: f"robot {onlooker.mode}" in match.said)
        assert "until somebody arms it: riposte robot arm" in match.said or victim == "robot-io-0"

        begin, shut = len(onlooker.states), len(onlooker.gates)
        onlooker.rest(6.0)  # everybody is back, policies answer, and nothing is commanded
        onlooker.until(lambda: len(onlooker.states) > begin + 200)
        assert len(onlooker.gates) > shut + 20
        assert not any(gate.is_sent for gate in onlooker.gates[shut:])
        # The other simulated robot, which no gate guards, may still lean on its bat.
        assert onlooker.travel(begin + 100) < 0.01
        assert onlooker.mode in STOPPED
        assert {state.bout for state in onlooker.referee} <= bouts | {""}
        assert (onlooker.states[-1].boot == boot) == (victim != "robot-io-0")

        if onlooker.mode == "tripped":
            assert cli.main(["robot", "arm", "--run", str(folder)]) == 1
            assert "reset it first" in capsys.readouterr().out
            assert cli.main(["robot", "reset", "--run", str(folder)]) == 0
        match.until(lambda: cli.main(["robot", "check", "--run", str(folder)]) == 0)
        match.until(lambda: cli.main(["robot", "arm", "--run", str(folder)]) == 0)
        onlooker.until(lambda: onlooker.is_fencing() and onlooker.referee[-1].bout not in bouts)
        match.process.send_signal(signal.SIGINT)
        match.finish()
    assert processes_of(folder) == []
    assert [line.split()[0] for line in match.summary["deaths"]] == [victim]
