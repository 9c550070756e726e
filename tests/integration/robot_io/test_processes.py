"""robot_io as a process: a real router, a real twin, a policy that is killed."""

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.play import BatStates, GateReply, GateRequest, GateState
from shared.messages.topics import ARM, BATS, GATE, STATUS

ROOT = Path(__file__).resolve().parents[3]
POLICY = Path(__file__).with_name("moving_policy.py")

pytestmark = pytest.mark.zenoh


class Site:
    """A router, robot_io and a policy, each a process; the test is the person."""

    def __init__(self, folder: Path) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.folder = folder
        self.processes: list[subprocess.Popen[bytes]] = []
        self.start("-m", "services.router", "--listen", self.endpoint)
        self.bus: Bus = open_zenoh(
            BusConfig(connect=(self.endpoint,)), "person", SystemClock(), "live"
        )
        self.bats = self.bus.subscribe(BATS)
        self.gates = self.bus.subscribe(GATE)
        self.status = self.bus.subscribe(STATUS, role="robot-io")
        self.states: list[BatStates] = []
        self.seen: list[GateState] = []
        self.robot = self.start("-m", "services.robot_io", "--connect", self.endpoint)
        self.policy = self.start(str(POLICY), self.endpoint)

    def start(self, *words: str) -> "subprocess.Popen[bytes]":
        named = ("--run", str(self.folder), "--run-id", "live") if words[0] == "-m" else ()
        process = subprocess.Popen([sys.executable, *words, *named], cwd=ROOT)
        self.processes.append(process)
        return process

    def until(self, condition: Callable[[], bool], seconds: float = 20.0) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            while (states := self.bats.take()) is not None:
                self.states.append(states)
            while (gate := self.gates.take()) is not None:
                self.seen.append(gate)
            if condition():
                return
            self.bus.wait(0.01)
        raise AssertionError(f"not within {seconds} s; the gate: {self.seen[-1:]}")

    def is_mode(self, mode: str) -> bool:
        return bool(self.seen) and self.seen[-1].mode == mode

    def ask(self, action: str) -> GateReply:
        asked = GateRequest(action=action, operator="test")  # type: ignore[arg-type]
        pending = self.bus.ask(ARM, asked, timeout=3.0)
        self.until(lambda: pending.take() is not None, 5.0)
        reply = pending.take()
        assert isinstance(reply, GateReply)
        return reply

    def arm(self) -> None:
        self.until(lambda: len(self.states) > 20)
        replies: list[GateReply] = []

        def accepted() -> bool:  # until the policy's process answers
            replies.append(self.ask("arm"))
            return replies[-1].accepted

        self.until(accepted)
        self.until(lambda: self.is_mode("armed"))

    def close(self) -> None:
        self.bus.close()
        for process in reversed(self.processes):
            process.kill()
            process.wait()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    site = Site(tmp_path)
    yield site
    site.close()


def test_a_policy_moves_the_robot_and_its_death_holds_then_trips(site: Site):
    site.arm()
    count = len(site.states)
    site.until(lambda: len(site.states) >= count + 200)
    tools = np.array([states.tools[1, :3] for states in site.states[count:]])
    assert np.ptp(tools[:, 2]) > 0.02

    site.policy.kill()
    site.policy.wait()
    count = len(site.seen)
    site.until(lambda: site.is_mode("tripped"), 5.0)
    modes = [gate.mode for gate in site.seen[count:]]
    assert "holding" in modes
    assert modes.index("holding") < modes.index("tripped")
    assert site.seen[-1].reason == "no usable command for 0.5 s"

    site.start(str(POLICY), site.endpoint)  # it comes back, and that alone moves nothing
    count = len(site.states)
    site.until(lambda: len(site.states) >= count + 150)
    still = np.array([states.tools[1, :3] for states in site.states[count + 50 :]])
    assert np.ptp(still, axis=0).max() < 0.002
    assert site.is_mode("tripped")
    assert "reset it first" in site.ask("arm").reasons[0]
    assert site.ask("reset").mode == "disarmed"
    site.arm()

    ticks = [states.tick for states in site.states]
    assert ticks == sorted(set(ticks))
    statuses = []
    site.until(lambda: (said := site.status.take()) is not None and not statuses.append(said))
    rates = statuses[0].rates
    for name in ("lateness_p50_ms", "lateness_p99_ms", "command_p50_ms", "command_p99_ms"):
        assert rates[name] >= 0.0
    assert rates["real_time_factor"] == pytest.approx(1.0, abs=0.2)
