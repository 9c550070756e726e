"""A robot whose computer is cut off from everybody: it holds, trips, and stays where it is."""

import contextlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from services.robot_io.config import SafetyConfig
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.message import Message
from shared.messages.play import (
    BatStates,
    GateReply,
    GateRequest,
    GateState,
    PlayReply,
    PlayRequest,
    RefereeState,
)
from shared.messages.topics import ARM, BATS, BOUT, GATE, REFEREE, Service
from shared.testing.network.commands import unavailable
from shared.testing.network.hosts import Host, Network
from tests.integration.hosts.cluster import Cluster
from tests.integration.training.training import log_of

pytestmark = [
    pytest.mark.chaos,
    pytest.mark.zenoh,
    pytest.mark.timeout(400),
    pytest.mark.skipif(bool(unavailable()), reason=unavailable()),
]
LIMITS = SafetyConfig()
CUT_SECONDS = 5.0


class Lab:
    """A router on one host, both policies and the referee on another, the robot on a third."""

    def __init__(self, network: Network, folder: Path) -> None:
        self.cluster = Cluster(network, folder)
        self.robot = network.host("robot")
        self.folder = folder / "live"
        desk = network.host("desk")
        listens = ("--listen", self.cluster.endpoint)
        self._start(self.cluster.learner, "router", str(self.cluster.site), *listens)
        for agent in ("antagonist", "protagonist"):
            self._join(desk, "policy", "--name", f"policy-{agent}", "--agent", agent)
        self._join(desk, "referee")
        self._join(self.robot, "robot-io", "--set", "safety.ramp=0.5")
        cfg = BusConfig(
            connect=(self.cluster.endpoint,),
            certificates=str(self.cluster.certificates),
            open_seconds=120.0,
        )
        self.bus: Bus = open_zenoh(cfg, "person", SystemClock(), "live", "operator")
        self._bats = self.bus.subscribe(BATS)
        self._gates = self.bus.subscribe(GATE)
        self._referee = self.bus.subscribe(REFEREE)
        self.states: list[BatStates] = []
        self.gates: list[GateState] = []
        self.phase = ""

    def until(self, condition: Callable[[], bool], seconds: float = 60.0) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            self._listen()
            if condition():
                return
            self.bus.wait(0.02)
        raise AssertionError(f"not within {seconds} s; the gate: {self.gates[-1:]}")

    def rest(self, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= deadline, seconds + 5.0)

    def ask(self, service: Service[Message, Message], request: Message) -> object:
        pending = self.bus.ask(service, request, timeout=3.0)
        self.until(lambda: pending.take() is not None, 5.0)
        return pending.take()

    def fence(self) -> None:
        """Arm the robot and begin a bout, until its bat has moved."""
        asked = PlayRequest(
            action="start", bout="cut", antagonist="scripted:stab",
            protagonist="scripted:heuristic",
        )  # fmt: skip

        def armed() -> bool:
            reply = self.ask(ARM, GateRequest(action=self._needed(), operator="test"))
            return isinstance(reply, GateReply) and self.mode == "armed"

        self.until(lambda: len(self.states) > 20, 120.0)
        self.until(armed, 60.0)
        reply = self.ask(BOUT, asked)
        assert isinstance(reply, PlayReply)
        assert reply.accepted, reply.reason
        self.until(lambda: self.phase == "running", 30.0)
        count = len(self.states)
        self.until(lambda: self._travelled(count) > 0.02, 30.0)

    @property
    def mode(self) -> str:
        return self.gates[-1].mode if self.gates else ""

    def close(self) -> None:
        self.bus.close()

    def _needed(self) -> str:
        return "reset" if self.mode == "tripped" else "arm"

    def _travelled(self, first: int) -> float:
        tips = [states.tools[1, :3] for states in self.states[first:]]
        return float(np.ptp(tips, axis=0).max()) if tips else 0.0

    def _listen(self) -> None:
        while (states := self._bats.take()) is not None:
            self.states.append(states)
        while (gate := self._gates.take()) is not None:
            self.gates.append(gate)
        while (said := self._referee.take()) is not None:
            self.phase = said.phase if isinstance(said, RefereeState) else self.phase

    def _join(self, host: Host, role: str, *words: str) -> None:
        where = ("--connect", self.cluster.endpoint)
        where += ("--certificates", str(self.cluster.certificates))
        self._start(host, role, *where, "--set", "bus.open_seconds=120", *words)

    def _start(self, host: Host, role: str, *words: str) -> None:
        run = ("--run", str(self.folder), "--run-id", "live")
        self.cluster.start(host, role, *words, *run)


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    with Network() as network, contextlib.closing(Lab(network, tmp_path)) as lab:
        yield lab


def test_a_robot_behind_a_cut_cable_holds_then_trips_and_never_moves_by_itself(lab: Lab):
    lab.fence()
    boot, last = lab.states[-1].boot, lab.states[-1].tools[1, :3]
    lab.robot.cut()
    count = len(lab.states)
    lab.rest(CUT_SECONDS)
    assert len(lab.states) - count < 30  # what was under way
    lab.robot.heal()
    count = len(lab.states)
    lab.until(lambda: len(lab.states) > count + 150, 60.0)
    late = lab.states[count:]
    assert late[-1].boot == boot  # the same process, whose loop went on
    assert late[-1].tick > lab.states[count - 1].tick + 100
    assert lab.mode == "tripped"
    tips = np.array([states.tools[1, :3] for states in late])
    assert np.ptp(tips, axis=0).max() < 0.002
    reach = LIMITS.game_speed * LIMITS.command_trip + LIMITS.lead
    assert np.linalg.norm(tips[0] - last) < reach
    low, high = np.array(LIMITS.box_low), np.array(LIMITS.box_high)
    commanded = np.array([gate.commanded[:3] for gate in lab.gates if gate.is_sent])
    assert np.all(commanded >= low - 1e-9)
    assert np.all(commanded <= high + 1e-9)

    changes = [e for e in log_of(lab.folder, "robot-io-0") if e["event"] == "gate_changed"]
    modes = [event["mode"] for event in changes]
    armed = len(modes) - 1 - modes[::-1].index("armed")
    assert modes[armed:] == ["armed", "holding", "tripped"]
    assert changes[-1]["reason"] == f"no usable command for {LIMITS.command_trip} s"
