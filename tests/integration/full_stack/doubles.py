"""All that stands around a robot, and none of it there: a PR2, SteamVR, a strap, a sound card.

The doubles stand behind the real libraries. What is to meet them gets ``Lab.environment`` and the
overrides of ``Lab.settings`` over ``deploy/robot.toml``.
"""

import contextlib
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from shared.testing.fake_bluez.packet import measurement
from shared.testing.fake_bluez.strap import FakeBluez
from shared.testing.fake_vive.runtime import compile_client, has_compiler
from shared.testing.private_bus import lacks_dbus, private_bus
from shared.testing.recorded_sound import RecordedSound, lacks_sound
from shared.testing.ros_master import has_ros_master
from tests.integration.training.training import ROOT
from tests.integration.vive.person import Person

SERIAL = "LHR-00000001"
BEAT_SECONDS = 1.0
PULSE = 130
"""Of somebody who fences (1/min)."""


def lacks() -> str:
    """Return what is missing here for a lab without a robot; empty when nothing is."""
    if not has_ros_master():
        return "needs Debian's ROS master: apt install python3-rosmaster"
    if not has_compiler():
        return "needs gcc for the double of SteamVR: apt install gcc libc6-dev"
    return lacks_sound() or lacks_dbus()


class FakeRobot:
    """A fake PR2 in a process of its own, set up as docs/robot.md says."""

    def __init__(self) -> None:
        """Start it; returns once its master answers."""
        self._process = subprocess.Popen(
            [sys.executable, "-m", "shared.testing.fake_pr2", "--port", "0", "--set-up"],
            cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self._process.stdout is not None
        self.master_uri = self._process.stdout.readline().strip().partition("=")[2]
        assert self.master_uri.startswith("http://"), "the fake PR2 did not start"

    def tell(self, word: str) -> None:
        """Type a word to it: press, release, wireless, unwire, halt or reset."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{word}\n")
        self._process.stdin.flush()

    def ask(self) -> str:
        """Return what it says of itself."""
        self.tell("status")
        assert self._process.stdout is not None
        for line in self._process.stdout:  # its log comes this way, too
            if line.startswith("tool at"):
                return line.strip()
        raise AssertionError("the fake PR2 has ended")

    def close(self) -> None:
        """Switch it off."""
        self._process.communicate("quit\n", timeout=30)


class Fencer(Person):
    """A person who thrusts deeper and sways, so that the bats meet now and then."""

    def bat(self, seconds: float) -> np.ndarray:
        """Return float64[4, 4], the bat in the world: a thrust each 2 s, from changing sides."""
        matrix = super().bat(seconds)
        matrix[0, 3] -= 0.25
        matrix[1, 3] += 0.12 * np.sin(2.0 * np.pi * 0.23 * seconds)
        matrix[2, 3] += 0.08 * np.sin(2.0 * np.pi * 0.31 * seconds)
        return matrix


class Lab:
    """The doubles, and the way to them."""

    def __init__(
        self, robot: FakeRobot, person: Person, bluez: FakeBluez, sound: RecordedSound, bus: str
    ) -> None:
        self.robot = robot
        self.person = person
        self.bluez = bluez
        self.sound = sound
        self.environment = {
            **sound.environment, **person.environment, "DBUS_SYSTEM_BUS_ADDRESS": bus,
        }  # fmt: skip
        """For the process that is to meet them."""
        self.settings = (
            *person.settings, f"pr2.master_uri={robot.master_uri}", "heart_rate.source=ble",
            "tones.sink=sounddevice",
        )  # fmt: skip
        """Over the site file."""
        self.beats = 0
        """Measurements of the heart rate that were sent."""
        self._stop = threading.Event()
        self._heart = threading.Thread(target=self._beat, name="heart", daemon=True)
        self._heart.start()

    def lose_tracker(self, *, is_lost: bool) -> None:
        """Hide the tracker from the base stations, or let them see it again."""
        self.person.is_lost = is_lost

    def close(self) -> None:
        """Take the strap off."""
        self._stop.set()
        self._heart.join(30.0)

    def _beat(self) -> None:
        """Send a measurement a second to whoever listens, at the strap's own pace."""
        due = time.monotonic()
        while not self._stop.wait(max(due - time.monotonic(), 0.0)):
            due += BEAT_SECONDS
            if self.bluez.wait_for_listener(0.0):
                self.bluez.notify(measurement(PULSE + self.beats % 10, contact=True))
                self.beats += 1


@contextlib.contextmanager
def lab() -> Iterator[Lab]:
    """Set everything up; all of it is gone at the end."""
    with contextlib.ExitStack() as stack:
        # Sockets lie in these: their names must be short.
        home, folder = (Path(stack.enter_context(tempfile.TemporaryDirectory())) for _ in range(2))
        robot = FakeRobot()
        stack.callback(robot.close)
        person = Fencer(folder, compile_client(folder / "vrclient"), SERIAL)
        stack.callback(person.close)
        sound = stack.enter_context(RecordedSound(home))
        bus = stack.enter_context(private_bus(folder))
        bluez = stack.enter_context(FakeBluez(bus))
        made = Lab(robot, person, bluez, sound, bus)
        stack.callback(made.close)
        yield made
