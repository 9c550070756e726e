"""How well protagonists play on the simulated robot of a laptop, and on the real one's twin.

robot_io, referee and a policy play whole bouts in one process, on a clock that is moved, against a
scripted antagonist whose bat is tracked and gives way to nothing, as that of a mouse does:
``python -m benchmarks.laptop_robot --bouts 4 --protagonists style-2 --antagonists stab``.
The table of docs/play.md is its output.
"""

import argparse
import functools
import logging
from pathlib import Path
from typing import Any

import numpy as np
import structlog

from services.jobs.play.plan import LAPTOP
from services.policy.acting import Acting
from services.policy.config import PolicyConfig
from services.policy.loading import Loader
from services.policy.service import Policy
from services.referee.config import RefereeConfig
from services.referee.service import Referee
from services.robot_io.__main__ import twin_parts
from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.service import RobotIo
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.config.site import load_section
from shared.errors import RiposteError
from shared.game.bout import Scoreboard
from shared.game.rules import RuleBook
from shared.messages.play import (
    BatStates,
    GateReply,
    GateRequest,
    PlayReply,
    PlayRequest,
    RefereeState,
    TrackerPose,
)
from shared.messages.topics import ARM, BATS, BOUT, REFEREE, TRACKER
from shared.policy.action import ActionConfig, desired_pose
from shared.policy.players import scripted_player
from shared.policy.snapshot import Fit
from shared.sim.arena import arena_of, bat_of, target_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.twin import Twin, command_of
from shared.styles.bundle import load_bundle, shipped_bundle

ROBOTS: dict[str, tuple[str, ...]] = {"real one's twin": (), "laptop's": LAPTOP}
MOST_TICKS = 4000
"""Of one bout; the longest there is has 2,000."""


class Fencing:
    """One robot, its player, a referee, and an antagonist with a tracked bat."""

    def __init__(self, protagonist: str, antagonist: str, words: tuple[str, ...]) -> None:
        sim, action = SimConfig(), ActionConfig()
        arena, target = arena_of(sim, action), target_of(sim)
        self.clock = ManualClock(50.0)
        hub = MemoryHub(self.clock)
        self.bus = hub.join("person")
        cfg = load_section(None, "robot_io", RobotIoConfig, (*words, 'robot_io.tracker="mouse"'))
        safety = load_section(None, "safety", SafetyConfig, words)
        period = sim.control_timestep
        io_bus, policy_bus, referee_bus = (hub.join(name) for name in ("io", "policy", "referee"))
        parts = twin_parts(cfg, safety, sim, io_bus)
        self.io = RobotIo(cfg, parts, period, io_bus, self.clock)
        loader = Loader("protagonist", Fit.of(action, period, None), arena, Path())
        self.policy = Policy(
            PolicyConfig(protagonist=player_of(protagonist)), "protagonist", loader,
            Acting("protagonist", target, action, 0), policy_bus, self.clock,
        )  # fmt: skip
        board = functools.partial(Scoreboard, 1, RuleBook(), bat_of(sim), target)
        self.referee = Referee(RefereeConfig(), board, period, referee_bus, self.clock)
        self.ghost = Twin(FencingModel.build(sim), command_of(1.0, 0.0), 100.0, person=False)
        self.acting = Acting("antagonist", target, action, 0)
        self.player = scripted_player(f"scripted:{antagonist}", arena)
        self._bats = self.bus.subscribe(BATS)
        self._said = self.bus.subscribe(REFEREE)
        self.state: RefereeState | None = None
        self.speeds: list[float] = []
        self._sent = 0

    def tick(self, ticks: int = 1) -> None:
        """Let 10 ms pass, so many times."""
        for _ in range(ticks):
            self.io.tick()
            while (states := self._bats.take()) is not None:
                self._move_person(states)
            for pause in (0.003, 0.003, 0.004):
                self.policy.tick()
                self.referee.tick()
                self.clock.advance(pause)
                self.io.tick()
            while (said := self._said.take()) is not None:
                self.state = said

    def _move_person(self, states: BatStates) -> None:
        if self.state is not None and self.state.phase == "running":
            self.speeds.append(float(np.linalg.norm(states.bats[1, 7:10])))
            offset = self.acting.offset(self.player, states.bats, states.seconds)
            if offset is not None:
                tool = self.ghost.tools()[0]
                self.ghost.command(0, desired_pose(offset[:, None], tool[:, None])[:, 0])
        self.ghost.step()
        pose = TrackerPose(sequence=self._sent, source="ghost", pose=self.ghost.bat(0)[:7])
        self.bus.publish(TRACKER, pose)
        self._sent += 1

    def ask(self, topic: Any, message: Any) -> GateReply | PlayReply:
        """Ask robot_io or the referee.

        Raises:
            RiposteError: it will not.
        """
        pending = self.bus.ask(topic, message, timeout=2.0)
        self.io.tick()
        self.referee.tick()
        answer = pending.take()
        if not isinstance(answer, GateReply | PlayReply) or not answer.accepted:
            raise RiposteError(f"refused: {answer}")
        return answer

    def bout(self, number: int) -> float:
        """Fence one bout; return the antagonist's score."""
        self.ghost.reset()
        self.tick(60)
        self.ask(BOUT, PlayRequest(
            action="start", bout=f"bout-{number}", antagonist="person", protagonist="robot",
        ))  # fmt: skip
        for _ in range(MOST_TICKS):
            self.tick()
            assert self.state is not None
            if self.state.phase in ("finished", "void"):
                break
        if self.state is None or self.state.phase != "finished":
            raise RiposteError(f"the bout did not come to its end: {self.state}")
        self.tick(300)
        return self.state.score


def player_of(name: str) -> str:
    """Return what a policy loads for a name of the bundle or of a scripted player."""
    loaded = load_bundle(shipped_bundle())
    for player in loaded.bundle.players:
        if player.name == name:
            return str(loaded.folder / f"{player.sha256}.safetensors")
    return f"scripted:{name}"


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bouts", type=int, default=4)
    parser.add_argument("--protagonists", nargs="+", default=["heuristic-retreating", "style-2"])
    parser.add_argument("--antagonists", nargs="+", default=["stab", "person-steady"])
    found = parser.parse_args()
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.ERROR))
    for protagonist in found.protagonists:
        for antagonist in found.antagonists:
            for name, words in ROBOTS.items():
                fencing = Fencing(protagonist, antagonist, words)
                fencing.tick(60)
                fencing.ask(ARM, GateRequest(action="arm", operator="benchmark"))
                fencing.tick(250)
                scores = [fencing.bout(number) for number in range(found.bouts)]
                error = np.std(scores) / len(scores) ** 0.5
                fast = np.percentile(fencing.speeds, 99)
                print(
                    f"{protagonist} v {antagonist}, {name} robot: {np.mean(scores):+,.0f} "
                    f"± {error:,.0f}, 99 % of the time under {fast:.2f} m/s",
                    flush=True,
                )


if __name__ == "__main__":
    main()
