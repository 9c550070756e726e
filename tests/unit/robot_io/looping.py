"""A loop on a twin, on the bus in memory and with a clock that is moved."""

from typing import Any

import numpy as np

from services.robot_io.__main__ import twin_parts
from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.service import RobotIo
from services.robot_io.twin import TwinLink
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.play import (
    BatStates,
    DesiredOffset,
    GateReply,
    GateRequest,
    GateState,
    RefereeState,
)
from shared.messages.topics import ARM, BATS, GATE, OFFSET, REFEREE
from shared.sim.config import SimConfig

HOLD = np.zeros(6)


class Looping:
    """robot_io, a policy that answers each tick, and a person at the button."""

    def __init__(self, **settings: Any) -> None:
        self.clock = ManualClock(50.0)
        hub = MemoryHub(self.clock)
        self.bus, self.bench = hub.join("robot-io-0"), hub.join("bench")
        self.bats = self.bench.subscribe(BATS)
        self.gates = self.bench.subscribe(GATE)
        cfg = RobotIoConfig(**settings)
        self.parts = twin_parts(cfg, SafetyConfig(), SimConfig(), self.bus)
        assert isinstance(self.parts.link, TwinLink)
        self.link = self.parts.link
        self.service = RobotIo(cfg, self.parts, 0.01, self.bus, self.clock)
        self.offset: np.ndarray | None = HOLD
        self.states: list[BatStates] = []
        self.seen: list[GateState] = []

    def tick(self, ticks: int = 1) -> "Looping":
        for _ in range(ticks):
            self.service.tick()
            while (states := self.bats.take()) is not None:
                self.states.append(states)
                if self.offset is not None:
                    self.say_offset("protagonist", self.offset)
            self.clock.advance(0.002)
            self.service.tick()
            self.clock.advance(0.004)
            self.service.tick()
            while (gate := self.gates.take()) is not None:
                self.seen.append(gate)
            self.clock.advance(0.004)
        return self

    def say_offset(self, agent: Any, offset: np.ndarray) -> None:
        answer = DesiredOffset(
            agent=agent, tick=self.states[-1].tick, boot=self.bus.boot, snapshot="test",
            offset=offset, took_ms=0.1,
        )  # fmt: skip
        self.bench.publish(OFFSET, answer, agent=agent)

    def ask(self, action: Any) -> GateReply:
        pending = self.bench.ask(ARM, GateRequest(action=action, operator="test"), timeout=1.0)
        self.service.tick()
        reply = pending.take()
        assert isinstance(reply, GateReply)
        return reply

    def armed(self) -> "Looping":
        self.tick(3)
        assert self.ask("arm") == GateReply(accepted=True, mode="ramping")
        self.tick(205)
        assert self.seen[-1].mode == "armed"
        return self

    def say_referee(self, phase: Any, seconds: float = 0.0, speed: float = 1.0) -> None:
        state = RefereeState(
            bout="b", phase=phase, antagonist="a", protagonist="p", tick=self.states[-1].tick,
            step=round(seconds * 100), seconds=seconds, score=0.0, points=0.0,
            in_target=np.zeros(2, bool), contact=False, attack_steps=0, penalty_steps=0,
            camping_steps=0, missed_ticks=0, tone_hz=0.0, speed=speed,
        )  # fmt: skip
        self.bench.publish(REFEREE, state)

    @property
    def tool(self) -> np.ndarray:
        return self.states[-1].tools[1]
