"""A site in one process whose time passes as fast as it is worked off.

The services are those of `riposte up deploy/programme.toml`: robot_io with the twin behind its
safety gate, referee, recorder. Only the bus (in memory) and the clock (moved by hand) are others.
"""

import functools
from pathlib import Path
from typing import Final, Literal, Protocol

import msgspec

from services.recorder.config import RecorderConfig
from services.recorder.live import about_of
from services.recorder.service import Recorder
from services.referee.config import RefereeConfig
from services.referee.service import Referee
from services.robot_io.__main__ import twin_parts
from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.service import RobotIo
from shared.bus.base import Bus
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.bout import Scoreboard
from shared.game.rules import RuleBook
from shared.messages.play import GateReply, GateRequest
from shared.messages.topics import ARM
from shared.policy.action import ActionConfig
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel

BEGAN: Final = 1000.0
PAST: Final = 1e-4
"""Ticks come so long after they are due, so that rounding makes none early (s)."""
PARKED: Final = Path(__file__).resolve().parents[2] / "deploy" / "parked_bat.npy"
"""A bat that lies still, 3 m away."""
RECORDER_TICKS: Final = 2
"""Of robot_io's, from one look of the recorder to the next."""


class Ticking(Protocol):
    """Somebody who takes part."""

    def tick(self) -> object:
        """Take what has come, and answer."""
        ...


class VirtualSite:
    """robot_io on a twin, a referee and a recorder, and time that the owner moves."""

    def __init__(
        self, folder: Path, robot: RobotIoConfig, safety: SafetyConfig, sim: SimConfig
    ) -> None:
        """Start them.

        Args:
            folder: of the run; the bouts' archive is in it.
            robot: of robot_io; the other bat is parked whatever it says.
            safety: limits of the gate.
            sim: the twin's model is in it.
        """
        self.clock = ManualClock(BEGAN)
        hub = MemoryHub(self.clock, max_messages=4096)
        self._hub = hub
        folder.mkdir(parents=True, exist_ok=True)
        cfg = msgspec.structs.replace(robot, tracker="replay", replay=str(PARKED))
        own = self._join("robot_io")
        parts = twin_parts(cfg, safety, sim, own)
        self.robot_io = RobotIo(cfg, parts, sim.control_timestep, own, self.clock)
        rules = RuleBook()
        board = functools.partial(Scoreboard, 1, rules, bat_of(sim), target_of(sim))
        self.referee = Referee(
            RefereeConfig(), board, sim.control_timestep, self._join("referee"), self.clock
        )
        model = FencingModel.build(sim)
        about = about_of(folder, model, {"game": rules, "sim": sim, "action": ActionConfig()}, "")
        self.recorder = Recorder(
            RecorderConfig(live=False), self._join("recorder"), self.clock, folder, model, about
        )
        self._period = sim.control_timestep
        self._ticks = 0
        self.clock.advance(PAST)

    @property
    def is_quiet(self) -> bool:
        """Return whether it is time for a person to do something: once a second."""
        return self._ticks % round(1.0 / self._period) == 0

    def join(self, name: str) -> Bus:
        """Return one more end of the bus."""
        return self._hub.join(name)

    def tick(self, *people: "Ticking") -> None:
        """Go on by one tick of the loop, in which ``people`` hear the states and answer."""
        self.robot_io.tick()
        for each in people:
            each.tick()
        self.robot_io.tick()  # sends what was answered
        self.referee.tick()
        self.clock.advance(0.8 * self._period)  # past its wait for an answer
        self.robot_io.tick()
        if self._ticks % RECORDER_TICKS == 0:
            self.recorder.tick()
        self.clock.advance(0.2 * self._period)
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
        for each in (self.robot_io, self.referee, self.recorder):
            each.close()

    def _join(self, role: str) -> Bus:
        bus = self._hub.join(f"{role}-0".replace("_", "-"))
        bus.declare_alive(role)
        return bus
