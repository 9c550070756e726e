"""A match whose robot_io and referee a test plays, on the bus in memory."""

from typing import Any

import msgspec
import numpy as np

from services.jobs.play.match import Match, Terms
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.play import (
    GateReply,
    GateRequest,
    GateState,
    PlayReply,
    PlayRequest,
    RefereeState,
)
from shared.messages.topics import ARM, BOUT, GATE, REFEREE

TERMS = Terms(
    antagonist="scripted:stab", protagonist="sha256:aa", bouts=2, arms=True, starts=True,
    rest=2.0, patience=30.0, operator="ada", again="riposte robot arm --run R",
)  # fmt: skip


class Stage:
    """Time passes in ticks of 0.1 s; robot_io does what it is told, the referee too."""

    def __init__(self, **changes: Any) -> None:
        self.clock = ManualClock(100.0)
        hub = MemoryHub(self.clock)
        self.play, self.robot, self.judge = (
            hub.join(name) for name in ("play", "robot-io-0", "referee-0")
        )
        self.judge.declare_alive("referee")
        self.arms = self.robot.answer(ARM)
        self.bouts = self.judge.answer(BOUT)
        self.match = Match(msgspec.structs.replace(TERMS, **changes), self.play, self.clock)
        self.mode: Any = "disarmed"
        self.reason = "nobody has armed it"
        self.obstacles: tuple[str, ...] = ()
        self.is_silent = False
        self.state: RefereeState | None = None
        self.asked: list[GateRequest] = []
        self.started: list[PlayRequest] = []
        self.abandoned: list[PlayRequest] = []
        self.refuses = ""
        self.events: list[str] = []

    def tick(self, seconds: float = 0.1) -> "Stage":
        for _ in range(round(seconds / 0.1)):
            self._robot_io()
            self._referee()
            self.match.tick()
            self.events += self.match.take_events()
            self.clock.advance(0.1)
        return self

    def _robot_io(self) -> None:
        if self.is_silent:
            return
        while (request := self.arms.take()) is not None:
            self.asked.append(request.message)
            is_arm = request.message.action == "arm"
            if not (is_arm and self.obstacles) and self.mode != "tripped":
                self.mode = "armed" if is_arm else "disarmed"
                self.reason = "" if is_arm else f"disarmed by {request.message.operator}"
            reasons = self.obstacles if is_arm else ()
            request.reply(GateReply(accepted=not reasons, mode=self.mode, reasons=reasons))
        self.robot.publish(
            GATE,
            GateState(
                tick=0, mode=self.mode, reason=self.reason, commanded=np.zeros(7),
                is_clipped=False, lateness_ms=0.1, late_ticks=0,
            ),
        )  # fmt: skip

    def _referee(self) -> None:
        while (request := self.bouts.take()) is not None:
            asked = request.message
            if asked.action == "start":
                if not self.refuses:
                    self.started.append(asked)
                    self.say("running", bout=asked.bout)
            else:
                self.abandoned.append(asked)
                self.say("void", bout=asked.bout, reason=asked.reason)
            request.reply(PlayReply(accepted=not self.refuses, phase="ready", reason=self.refuses))

    def say(self, phase: Any, score: float = 0.0, bout: str = "", reason: str = "") -> None:
        bout = bout or (self.state.bout if self.state is not None else "")
        self.state = RefereeState(
            bout=bout, phase=phase, reason=reason, antagonist="a", protagonist="p", tick=1,
            step=100, seconds=1.0, score=score, points=0.0, in_target=np.zeros(2, bool),
            contact=False, attack_steps=7, penalty_steps=1, camping_steps=0, missed_ticks=2,
            tone_hz=0.0,
        )  # fmt: skip
        self.judge.publish(REFEREE, self.state)

    def restart_referee(self) -> None:
        self.state = None
        state = RefereeState(
            bout="", phase="ready", antagonist="", protagonist="", tick=1, step=0, seconds=0.0,
            score=0.0, points=0.0, in_target=np.zeros(2, bool), contact=False, attack_steps=0,
            penalty_steps=0, camping_steps=0, missed_ticks=0, tone_hz=0.0,
        )  # fmt: skip
        self.judge.publish(REFEREE, state)

    def in_bout(self) -> "Stage":
        self.tick(4.0)
        assert self.state is not None
        assert self.state.phase == "running"
        return self

    @property
    def arm_count(self) -> int:
        return sum(request.action == "arm" for request in self.asked)
