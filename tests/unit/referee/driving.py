"""A referee on a bus in memory, a clock that is moved, and bats that are put somewhere."""

import functools

import numpy as np

from services.referee.config import RefereeConfig
from services.referee.service import Referee
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.game.bout import Scoreboard
from shared.game.geometry import BatShape, Target
from shared.game.rules import RuleBook
from shared.messages.play import BatStates, PlayReply, PlayRequest, RefereeState
from shared.messages.topics import BATS, BOUT, REFEREE

DT = 0.01
TARGET = Target((0.0, 0.0, 1.0), 0.2)


def bats(antagonist: float = 1.0, protagonist: float = 2.0) -> np.ndarray:
    """Return float64[2, 13]: both bats along x at these heights over the target's centre."""
    states = np.zeros((2, 13))
    states[:, 0] = -0.3
    states[:, 2] = 1.0 + antagonist, 1.0 + protagonist
    states[:, 3] = 1.0
    return states


APART = bats()
HIT = bats(0.0, 2.0)
PENALTY = bats(0.0, 0.03)
CAMP = bats(1.0, 0.0)


class Stand:
    """The referee and everybody it talks to."""

    def __init__(self, *, bout_steps: int = 50, camping_steps: int = 200, **cfg: float) -> None:
        rules = RuleBook(bout_steps=bout_steps, camping_steps=camping_steps)
        self.clock = ManualClock(100.0)
        self._hub = MemoryHub(self.clock)
        self.bus = self._hub.join("others")
        self.referee = Referee(
            RefereeConfig(**cfg), functools.partial(Scoreboard, 1, rules, BatShape(), TARGET), DT,
            self._hub.join("referee-0"), self.clock,
        )  # fmt: skip
        self._states = self.bus.subscribe(REFEREE)
        self.tick = 0
        self.boot = "b1"

    def bring(
        self,
        where: np.ndarray = APART,
        count: int = 1,
        *,
        tick: int | None = None,
        is_valid: tuple[bool, bool] = (True, True),
    ) -> RefereeState:
        """Let so many ticks arrive, 10 ms apart; return where the bout stands then."""
        for _ in range(count):
            self.send(where, tick=tick, is_valid=is_valid)
            self.clock.advance(DT)
            self.referee.tick()
        return self.state

    def send(
        self,
        where: np.ndarray = APART,
        *,
        tick: int | None = None,
        is_valid: tuple[bool, bool] = (True, True),
    ) -> None:
        """Publish one tick; the referee has not looked at it yet."""
        self.tick = self.tick if tick is None else tick
        self.bus.publish(
            BATS,
            BatStates(
                tick=self.tick, boot=self.boot, at_ns=0, bats=where, tools=np.zeros((2, 7)),
                is_valid=np.array(is_valid), seconds=0.0,
            ),
        )  # fmt: skip
        self.tick += 1

    def lose(self, ticks: int) -> None:
        """Let so many ticks get lost, in no time."""
        self.tick += ticks

    def silence(self, seconds: float) -> RefereeState:
        """Let time pass without any state; robot_io goes on counting."""
        for _ in range(round(seconds / DT)):
            self.tick += 1
            self.clock.advance(DT)
            self.referee.tick()
        return self.state

    def ask(self, action: str, bout: str = "one", **fields: object) -> PlayReply:
        request = PlayRequest(action=action, bout=bout, **fields)  # type: ignore[arg-type]
        pending = self.bus.ask(BOUT, request, 1.0)
        self.referee.tick()
        answer = pending.take()
        assert isinstance(answer, PlayReply), answer
        return answer

    def start(self, bout: str = "one", seconds: float = 0.0) -> PlayReply:
        """Bring enough good states, and start a bout."""
        self.bring(APART, 25)
        return self.ask(
            "start", bout, antagonist="person", protagonist="scripted:guard", seconds=seconds
        )

    @property
    def state(self) -> RefereeState:
        return self.referee.state()

    def published(self) -> RefereeState | None:
        """Return what was published last, if anything was since the last time."""
        return self._states.take()
