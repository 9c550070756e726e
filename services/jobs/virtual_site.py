"""A site in one process whose time passes as fast as it is worked off.

The services are those that `riposte up` and `riposte play` start: robot_io with the twin behind its
safety gate, referee, recorder and, where one is named, a policy. Only the bus (in memory) and the
clock (moved by hand) are others.
"""

import functools
from collections.abc import Iterable
from pathlib import Path
from typing import Final, Literal, Protocol

import msgspec

from services.policy.acting import Acting
from services.policy.config import PolicyConfig
from services.policy.loading import Loader
from services.policy.service import Policy
from services.recorder.config import RecorderConfig
from services.recorder.live import about_of
from services.recorder.service import Recorder
from services.referee.config import RefereeConfig
from services.referee.service import Referee
from services.robot_io.__main__ import twin_parts
from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.extras import Extras
from services.robot_io.heart_rate.source import HeartRateConfig, HeartRateFeed, HeartRateSource
from services.robot_io.service import RobotIo
from shared.bus.base import Bus
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.bout import Scoreboard
from shared.game.rules import RuleBook
from shared.messages.play import GateReply, GateRequest
from shared.messages.topics import ARM
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit
from shared.sim.arena import arena_of, bat_of, target_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel

BEGAN: Final = 1000.0
PAST: Final = 1e-4
"""Ticks come so long after they are due, so that rounding makes none early (s)."""
RECORDER_TICKS: Final = 2
"""Of robot_io's, from one look of the recorder to the next."""
HOP: Final = 0.09
"""Longest tick in which what must not be silent for 0.1 s, tracker and policy, is not (s)."""


class Ticking(Protocol):
    """Somebody who takes part."""

    def tick(self) -> object:
        """Take what has come, and answer."""
        ...


class VirtualSite:
    """robot_io on a twin, referee, recorder, perhaps a policy, and time that the owner moves."""

    def __init__(
        self, folder: Path, robot: RobotIoConfig, safety: SafetyConfig, sim: SimConfig, *,
        rules: RuleBook | None = None, policy: PolicyConfig | None = None,
        heart: HeartRateSource | None = None, recorder: RecorderConfig | None = None,
        clock: ManualClock | None = None, players: Iterable[str] = (),
    ) -> None:  # fmt: skip
        """Start them.

        Args:
            folder: of the run; the bouts' archive is in it.
            robot: of robot_io; says what follows the other bat.
            safety: limits of the gate.
            sim: the twin's model is in it.
            rules: of the game; the paper's where none are given.
            policy: of the robot's player; where there is none, somebody else moves the robot.
            heart: the strap of the person who plays, if one is worn.
            recorder: what is recorded; by default everything but the live view.
            clock: that the site moves on; one of its own where none is given.
            players: that the policy may be asked to be, besides scripted ones.
        """
        self.clock = clock or ManualClock(BEGAN)
        hub = MemoryHub(self.clock, max_messages=4096)
        self._hub = hub
        folder.mkdir(parents=True, exist_ok=True)
        rules, action, target = rules or RuleBook(), ActionConfig(), target_of(sim)
        period = sim.control_timestep
        own = self._join("robot_io")
        parts = twin_parts(robot, safety, sim, own)
        if heart is not None:
            feed = HeartRateFeed(heart, HeartRateConfig().stale_after, own)
            parts = msgspec.structs.replace(parts, extras=Extras((feed,)))
        self.robot_io = RobotIo(robot, parts, period, own, self.clock)
        board = functools.partial(Scoreboard, 1, rules, bat_of(sim), target)
        self.referee = Referee(
            RefereeConfig(), board, period, self._join("referee"), self.clock
        )  # fmt: skip
        self.policy: Policy | None = None
        if policy is not None:
            fit = Fit.of(action, period, policy.model or None)
            loader = Loader("protagonist", fit, arena_of(sim, action), folder, frozenset(players))
            acting = Acting("protagonist", target, action, policy.seed)
            self.policy = Policy(
                policy, "protagonist", loader, acting, self._join("policy"), self.clock
            )
        model = FencingModel.build(sim)
        about = about_of(folder, model, {"game": rules, "sim": sim, "action": action}, "")
        self.recorder = Recorder(
            recorder or RecorderConfig(live=False), self._join("recorder"), self.clock, folder,
            model, about,
        )  # fmt: skip
        self._period = period
        self._ticks = 0
        self.clock.advance(PAST)

    @property
    def is_quiet(self) -> bool:
        """Return whether it is time for a person to do something: once a second."""
        return self._ticks % round(1.0 / self._period) == 0

    def join(self, name: str, role: str = "") -> Bus:
        """Return one more end of the bus, alive as ``role`` where one is given."""
        bus = self._hub.join(name)
        if role:
            bus.declare_alive(role)
        return bus

    def tick(self, *people: "Ticking", seconds: float = 0.0) -> None:
        """Go on by one tick of the loop, in which ``people`` hear the states and answer.

        Args:
            people: who takes part.
            seconds: how long the tick is, at least a period. A longer one leaves ticks of the loop
                out, for times in which nothing has to be judged; one over ``HOP`` loses the bat.
        """
        self.robot_io.tick()
        if self.policy is not None:
            self.policy.tick()
        for each in people:
            each.tick()
        self.robot_io.tick()  # sends what was answered
        self.referee.tick()
        answered = 0.8 * self._period  # past its wait for an answer
        self.clock.advance(answered)
        self.robot_io.tick()
        if self._ticks % RECORDER_TICKS == 0:
            self.recorder.tick()
        self.clock.advance(max(seconds, self._period) - answered)
        self._ticks += 1

    def ask(self, bus: Bus, action: Literal["arm", "disarm"]) -> GateReply:
        """Do at the gate what a person does.

        Raises:
            TypeError: nobody answered.
        """
        asked = GateRequest(action=action, operator="the study")
        pending = bus.ask(ARM, asked, timeout=1.0)
        self.tick()
        reply = pending.take()
        if not isinstance(reply, GateReply):
            raise TypeError(f"robot_io answered {reply}")
        return reply

    def close(self) -> None:
        """Stop all of them, the recorder last."""
        for each in (self.robot_io, self.policy, self.referee, self.recorder):
            if each is not None:
                each.close()

    def _join(self, role: str) -> Bus:
        return self.join(f"{role}-0".replace("_", "-"), role)
