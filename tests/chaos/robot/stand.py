"""A lab with no robot in it: router, robot_io and a policy as processes, a fake PR2 or the twin.

The test is the operator, who arms, and the person, whose bat is tracked until she lets go of it.
"""

import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from services.robot_io.config import SafetyConfig
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.play import BatStates, GateReply, GateRequest, GateState, TrackerPose
from shared.messages.topics import ARM, BATS, GATE, STATUS, TRACKER
from shared.testing.fake_pr2.fake import FakePr2
from shared.testing.ros_master import has_ros_master

Link = Literal["twin", "pr2"]
ROOT = Path(__file__).resolve().parents[3]
POLICY = Path(__file__).with_name("policy.py")
LIMITS = SafetyConfig()
PERSON = np.array([1.0, 0.6, 1.2, 1.0, 0.0, 0.0, 0.0])
"""Where the person's bat is: out of the way of the robot's."""
BOTH = [
    "twin",
    pytest.param(
        "pr2",
        marks=pytest.mark.skipif(
            not has_ros_master(), reason="needs Debian's ROS master: apt install python3-rosmaster"
        ),
    ),
]


class Person(threading.Thread):
    """Holds a bat in sight of a tracker, 100 times a second."""

    def __init__(self, bus: Bus) -> None:
        super().__init__(name="person", daemon=True)
        self.is_tracked = True
        self._bus = bus
        self._over = threading.Event()
        self.start()

    def run(self) -> None:
        sequence = 0
        while not self._over.wait(0.01):
            if self.is_tracked:
                pose = TrackerPose(sequence=sequence, source="person", pose=PERSON)
                self._bus.publish(TRACKER, pose)
            sequence += 1

    def end(self) -> None:
        self._over.set()
        self.join(5.0)


class Stand:
    """Everything that runs in a live bout but a referee."""

    def __init__(self, folder: Path, link: Link) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self._run = ("--run", str(folder), "--run-id", "live")
        self.processes: list[subprocess.Popen[bytes]] = []
        self.fake = started_fake() if link == "pr2" else None
        self.router = self.start_router()
        try:
            self.bus = self._join("operator")
            self._hand = self._join("hand")
        except BaseException:
            self._end()
            raise
        self.person = Person(self._hand)
        self._bats = self.bus.subscribe(BATS)
        self._gates = self.bus.subscribe(GATE)
        self.status = self.bus.subscribe(STATUS, role="robot-io")
        self.states: list[BatStates] = []
        self.seen: list[GateState] = []
        self._words = ["safety.ramp=0.5", 'robot_io.tracker="mouse"']
        if self.fake is not None:
            self._words += ['robot_io.link="pr2"', 'pr2.host="127.0.0.1"']
            self._words.append(f'pr2.master_uri="{self.fake.master_uri}"')
        self.robot_io = self.start_robot_io()

    def start_robot_io(self) -> "subprocess.Popen[bytes]":
        words = [word for setting in self._words for word in ("--set", setting)]
        return self.service("robot_io", *words)

    def start_router(self) -> "subprocess.Popen[bytes]":
        return self._start("-m", "services.router", *self._run, "--listen", self.endpoint)

    def start_policy(self, kind: str = "moving") -> "subprocess.Popen[bytes]":
        return self._start(str(POLICY), kind, self.endpoint)

    def service(self, module: str, *words: str) -> "subprocess.Popen[bytes]":
        return self._start(
            "-m", f"services.{module}", *self._run, "--connect", self.endpoint, *words
        )

    def kill(self, process: "subprocess.Popen[bytes]") -> None:
        """As by ``kill -9``."""
        process.kill()
        process.wait()

    def until(self, condition: Callable[[], bool], seconds: float = 20.0) -> None:
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            while (states := self._bats.take()) is not None:
                self.states.append(states)
            while (gate := self._gates.take()) is not None:
                self.seen.append(gate)
            if condition():
                return
            self.bus.wait(0.01)
        raise AssertionError(f"not within {seconds} s; the gate: {self.seen[-1:]}")

    def rest(self, seconds: float) -> None:
        """Listen for so long."""
        deadline = time.monotonic() + seconds
        self.until(lambda: time.monotonic() >= deadline, seconds + 5.0)

    def is_mode(self, *modes: str) -> bool:
        return bool(self.seen) and self.seen[-1].mode in modes

    def ask(self, action: str) -> GateReply:
        asked = GateRequest(action=action, operator="test")  # type: ignore[arg-type]
        pending = self.bus.ask(ARM, asked, timeout=3.0)
        self.until(lambda: pending.take() is not None, 5.0)
        reply = pending.take()
        assert isinstance(reply, GateReply)
        return reply

    def arm(self, seconds: float = 40.0) -> None:
        """Do what a person does who reads what is in the way, until it is armed.

        A machine that stands still for a tenth of a second trips the gate, rightly; then again.
        """
        replies: list[GateReply] = []

        def armed() -> bool:
            if self.is_mode("tripped"):
                self.ask("reset")
                if self.fake is not None:
                    self.fake.put_back()
            elif self.is_mode("disarmed"):
                replies.append(self.ask("arm"))
            return self.is_mode("armed")

        count = len(self.states)
        self.until(lambda: len(self.states) > count + 20, seconds)
        try:
            self.until(armed, seconds)
        except AssertionError as error:
            raise AssertionError(f"not armed: {replies[-1:]}") from error

    def move(self, kind: str = "moving") -> "subprocess.Popen[bytes]":
        """Arm it under a policy and wait until it moves."""
        policy = self.start_policy(kind)
        self.go_on()
        return policy

    def go_on(self) -> None:
        """Arm it under the policy that runs and wait until it moves."""

        def moves() -> bool:
            if not self.is_mode("armed"):
                self.arm()
            return travelled(self.tools(-60)) > 0.02

        self.until(moves, 60.0)

    def tools(self, first: int) -> np.ndarray:
        """Where the tool was in the states from a number on, or the last: float64[T, 3]."""
        return np.array([states.tools[1, :3] for states in self.states[first:]]).reshape(-1, 3)

    def assert_stays(self, seconds: float = 1.0, within: float = 0.003) -> None:
        """It comes to rest, and then nothing moves it."""
        self.rest(2.5)
        count = len(self.states)
        began = time.monotonic()
        self.rest(seconds)
        assert travelled(self.tools(count)) < within
        if (fake := self.fake) is not None:
            self.until(lambda: len(fake.moments(began)) > 50)
            moments = fake.moments(began)
            assert travelled(np.array([moment.tool[:3] for moment in moments])) < within
            assert fake.commands(began) == []  # not a word to the robot

    def assert_stays_shut(self) -> None:
        """Still tripped, still at rest, and it cannot simply be armed."""
        assert self.is_mode("tripped"), self.seen[-1]
        self.assert_stays()
        assert self.is_mode("tripped")
        assert not self.ask("arm").accepted

    def close(self) -> None:
        self.person.end()
        self._hand.close()
        self.bus.close()
        self._end()

    def _end(self) -> None:
        for process in reversed(self.processes):
            self.kill(process)
        if self.fake is not None:
            self.fake.close()

    def _join(self, name: str) -> Bus:
        return open_zenoh(BusConfig(connect=(self.endpoint,)), name, SystemClock(), "live")

    def _start(self, *words: str) -> "subprocess.Popen[bytes]":
        process = subprocess.Popen([sys.executable, *words], cwd=ROOT)
        self.processes.append(process)
        return process


def started_fake() -> FakePr2:
    fake = FakePr2()
    fake.set_up()
    return fake


def travelled(places: np.ndarray) -> float:
    """The largest extent of a way along an axis (m)."""
    return float(np.ptp(places, axis=0).max()) if len(places) else 0.0
