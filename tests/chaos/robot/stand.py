"""A lab with no robot in it: router, robot_io and a policy as processes, a fake PR2 or the twin.

The test is the operator, who arms, and the person, whose bat is tracked until she lets go of it.
"""

import subprocess
import threading
import time
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from services.robot_io.config import SafetyConfig
from shared.bus.base import Bus
from shared.messages.play import GateReply, TrackerPose
from shared.messages.topics import TRACKER
from shared.testing.fake_pr2.fake import FakePr2
from shared.testing.ros_master import has_ros_master
from tests.integration.robot_io.site import Site

Link = Literal["twin", "pr2"]
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


class Stand(Site):
    """Everything that runs in a live bout but a referee."""

    def __init__(self, folder: Path, link: Link) -> None:
        self.fake = started_fake() if link == "pr2" else None
        settings = ['robot_io.tracker="mouse"']
        if self.fake is not None:
            settings += ['robot_io.link="pr2"', 'pr2.host="127.0.0.1"']
            settings.append(f'pr2.master_uri="{self.fake.master_uri}"')
        super().__init__(folder, *settings)
        try:
            self._hand = self.join("hand")
        except BaseException:
            super().close()
            raise
        self.person = Person(self._hand)

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
        super().close()

    def end(self) -> None:
        super().end()
        if self.fake is not None:
            self.fake.close()


def started_fake() -> FakePr2:
    fake = FakePr2()
    fake.set_up()
    return fake


def travelled(places: np.ndarray) -> float:
    """The largest extent of a way along an axis (m)."""
    return float(np.ptp(places, axis=0).max()) if len(places) else 0.0
