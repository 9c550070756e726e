"""robot_io's own loop on the twin or on a fake PR2 over real sockets, on a clock that is moved.

Nothing happens between two ticks but what the test waits for, so a busy machine changes nothing.
The test is the policy, the operator and the person with the tracked bat.
"""

import time
from collections.abc import Callable
from typing import Any, Literal

import numpy as np

from services.robot_io.__main__ import twin_parts
from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.pr2.config import Pr2Config
from services.robot_io.pr2.link import Pr2Link
from services.robot_io.pr2.parts import pr2_parts
from services.robot_io.service import Parts, RobotIo
from services.robot_io.twin import TwinLink
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.play import (
    BatStates,
    DesiredOffset,
    GateReply,
    GateRequest,
    GateState,
    TrackerPose,
)
from shared.messages.topics import ARM, BATS, GATE, OFFSET, TRACKER
from shared.sim.config import SimConfig
from shared.testing.fake_pr2.fake import FakePr2

Kind = Literal["twin", "pr2"]
Policy = Callable[[int], np.ndarray | None]
"""Returns float64[6] for a tick, or None to be silent."""
PERIOD = 0.01
REACH = 0.0375
SAFETY = SafetyConfig(ramp=0.5)
PERSON = np.array([1.0, 0.6, 1.2, 1.0, 0.0, 0.0, 0.0])
"""Where the person's bat is: out of the way of the robot's."""
SETTLED = 2.5
"""After so long a PR2's arm has come to where its controller holds it (s)."""
_REAL_TICK = 0.004
"""The link's own threads ask and tell in real time; a tick lasts at least so long (s)."""


def stay(tick: int) -> np.ndarray:
    return np.zeros(6)


def up_and_down(tick: int) -> np.ndarray:
    """What a policy may ask at most, up for half a second and down for half a second."""
    return np.array([0.0, 0.0, REACH if tick % 100 < 50 else -REACH, 0.0, 0.0, 0.0])


def silent(tick: int) -> None:
    return None


class Lockstep:
    """One robot, the loop and everybody around it."""

    def __init__(self, kind: Kind, safety: SafetyConfig = SAFETY) -> None:
        self.clock = ManualClock(50.0)
        hub = MemoryHub(self.clock)
        bus, self._bench = hub.join("robot-io-0"), hub.join("bench")
        self._boot = bus.boot
        self._bats, self._gates = self._bench.subscribe(BATS), self._bench.subscribe(GATE)
        cfg = RobotIoConfig(link=kind, tracker="mouse")
        self.safety = safety
        self.fake = driven_fake(self.clock) if kind == "pr2" else None
        self.parts = self._parts(cfg, bus)
        self.link = self.parts.link
        self.service = RobotIo(cfg, self.parts, PERIOD, bus, self.clock)
        self.policy: Policy = stay
        self.is_tracked = True
        self.states: list[BatStates] = []
        self.seen: list[GateState] = []
        self._sequence = 0
        self._behind: dict[Any, int] = {}
        """How many messages a reader of the link was not there for yet."""
        if self.fake is not None:
            assert isinstance(self.link, Pr2Link)
            # All of them: what is published before a reader is there never reaches it.
            wait_for(lambda: all(reader.received for reader, _ in self._wires()), self._nudge)
            assert self.counter("pr2_states") > 0
            self.until(lambda: not self.obstacles(), 8.0)

    def _parts(self, cfg: RobotIoConfig, bus: Any) -> Parts:
        if self.fake is None:
            return twin_parts(cfg, self.safety, SimConfig(), bus)
        pr2 = Pr2Config(master_uri=self.fake.master_uri, host="127.0.0.1")
        return pr2_parts(cfg, pr2, self.safety, SimConfig(), bus, self.clock)

    def tick(self, ticks: int = 1) -> "Lockstep":
        for _ in range(ticks):
            began = time.monotonic()
            if self.is_tracked:
                pose = TrackerPose(sequence=self._sequence, source="person", pose=PERSON)
                self._bench.publish(TRACKER, pose)
            self._sequence += 1
            self._move_robot()
            self._send()
            while (states := self._bats.take()) is not None:
                self.states.append(states)
                if (offset := self.policy(states.tick)) is not None:
                    self._answer(states.tick, offset)
            self.clock.advance(0.002)
            self._send()
            self.clock.advance(0.004)
            self._send()
            self.clock.advance(0.004)
            if self.fake is not None:
                time.sleep(max(_REAL_TICK - (time.monotonic() - began), 0.0))
        return self

    def rest(self, seconds: float) -> None:
        self.tick(round(seconds / PERIOD))

    def until(self, condition: Callable[[], bool], seconds: float = 5.0) -> None:
        """Tick until it is so, for so many seconds at most."""
        for _ in range(round(seconds / PERIOD)):
            if condition():
                return
            self.tick()
        assert condition(), f"not within {seconds} s; the gate: {self.seen[-1:]}"

    def mode(self) -> str:
        return self.seen[-1].mode

    def ask(self, action: Any) -> GateReply:
        pending = self._bench.ask(ARM, GateRequest(action=action, operator="test"), timeout=1.0)
        self.service.tick()
        reply = pending.take()
        assert isinstance(reply, GateReply)
        return reply

    def obstacles(self) -> tuple[str, ...]:
        """What stands in the way of arming."""
        reply = self.ask("check")
        return reply.reasons

    def arm(self) -> "Lockstep":
        """Arm it as soon as nothing is in the way, and wait until its ramp is over."""
        self.until(lambda: not self.obstacles(), 8.0)
        reply = self.ask("arm")
        assert reply.accepted, reply.reasons
        self.until(lambda: self.mode() == "armed")
        return self

    def move(self, policy: Policy = up_and_down) -> "Lockstep":
        """Arm it under a policy, and see that it moves."""
        self.policy = policy
        self.arm()
        count = len(self.states)
        self.until(lambda: extent(self.tools(count)) > 0.02)
        return self

    def rearm(self) -> None:
        """Do what a person does after a trip: reset, put the arm back, arm; and see it move."""
        self.until(lambda: self.ask("reset").accepted, 8.0)
        self.put_back()
        self.move()

    def put_back(self) -> None:
        """Put a PR2's arm back by hand; the twin's reset does that."""
        if self.fake is not None:
            self.fake.put_back()
            self.rest(0.3)

    def trips(self, words: str, within: float) -> None:
        self.until(lambda: self.mode() == "tripped", within)
        assert words in self.seen[-1].reason, self.seen[-1].reason

    def stays(self, seconds: float = 1.0) -> None:
        """It comes to rest; then nothing moves it, and not a word goes to it."""
        self.rest(0.8 if self.fake is None else SETTLED)
        sent, count = self.service.health().counters["commands_sent"], len(self.states)
        self.rest(seconds)
        assert extent(self.tools(count)) < 0.003
        assert self.service.health().counters["commands_sent"] == sent

    def stays_shut(self, seconds: float = 1.0) -> None:
        """The same, tripped, and it cannot simply be armed."""
        assert self.mode() == "tripped"
        self.stays(seconds)
        assert self.mode() == "tripped"
        assert not self.ask("arm").accepted

    def tools(self, first: int) -> np.ndarray:
        """Where the tool was in the states from a number on: float64[T, 3]."""
        return np.array([states.tools[1, :3] for states in self.states[first:]]).reshape(-1, 3)

    def counter(self, name: str) -> int:
        return self.link.counters()[name]

    def press_run_stop(self) -> None:
        if self.fake is not None:
            self.fake.press_run_stop()
        else:
            self._twin().press_run_stop()

    def release_run_stop(self) -> None:
        if self.fake is not None:
            self.fake.release_run_stop()
        else:
            self._twin().release_run_stop()

    def restart_controller(self) -> None:
        if self.fake is not None:
            assert self.fake.switch(["r_cart"], [])
        else:
            self._twin().restart_controller()

    def close(self) -> None:
        self.service.close()
        if self.fake is not None:
            self.fake.close()

    def _twin(self) -> TwinLink:
        assert isinstance(self.link, TwinLink)
        return self.link

    def _answer(self, tick: int, offset: np.ndarray) -> None:
        answer = DesiredOffset(
            agent="protagonist", tick=tick, boot=self._boot, snapshot="test",
            offset=offset, took_ms=0.1,
        )  # fmt: skip
        self._bench.publish(OFFSET, answer, agent="protagonist")

    def _send(self) -> None:
        """Let the loop do what it will, and wait until the robot has heard it."""
        self.service.tick()
        while (gate := self._gates.take()) is not None:
            self.seen.append(gate)
        if self.fake is not None:
            sent = self.counter("pr2_commands")
            wait_for(lambda: self._heard() >= sent)

    def _move_robot(self) -> None:
        """Let the robot's time pass, and wait until the link has heard what it said."""
        if self.fake is None:
            return
        self.fake.catch_up()
        for reader, writer in self._wires():
            if reader not in self._behind:
                self._behind[reader] = writer.published - writer.dropped - reader.received
            wait_for(
                lambda r=reader, w=writer: r.received >= w.published - w.dropped - self._behind[r]
            )

    def _wires(self) -> list[tuple[Any, Any]]:
        """What the link reads, each with who writes it."""
        assert self.fake is not None
        assert isinstance(self.link, Pr2Link)
        wires = self.fake._wires
        pairs = [(self.link._joints, wires._joints), (self.link._boards, wires._power),
                 (self.link._motors, wires._halted)]  # fmt: skip
        if (topics := wires.carts.get("r_cart")) is not None:
            pairs.append((self.link._states, topics.state))
        return pairs

    def _heard(self) -> int:
        assert self.fake is not None
        return self.fake._wires.carts["r_cart"].pose.received

    def _nudge(self) -> None:
        assert self.fake is not None
        self.clock.advance(PERIOD)
        self.fake.catch_up()
        self.link.read(self.clock.now())
        time.sleep(0.005)


def driven_fake(clock: ManualClock) -> FakePr2:
    fake = FakePr2(clock=clock, is_driven=True)
    fake.set_up()
    return fake


def wait_for(condition: Callable[[], bool], meanwhile: Callable[[], None] | None = None) -> None:
    """Wait in real time for what sockets and threads do."""
    deadline = time.monotonic() + 20.0
    while not condition():
        assert time.monotonic() < deadline, "the sockets stand still"
        time.sleep(0.0002) if meanwhile is None else meanwhile()


def extent(places: np.ndarray) -> float:
    """The largest extent of a way along an axis (m)."""
    return float(np.ptp(places, axis=0).max()) if len(places) else 0.0
