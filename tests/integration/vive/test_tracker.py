"""A tracker in real time: its rate, what is lost and comes back, what is not believed."""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from services.robot_io.__main__ import build
from services.robot_io.trackers import TrackedBat
from services.robot_io.vive.child import ViveChild
from services.robot_io.vive.config import ViveConfig
from services.robot_io.vive.frames import IDENTITY
from services.robot_io.vive.tracker import ViveTracker, open_vive
from shared.bus.memory import MemoryHub
from shared.clock import SystemClock
from shared.errors import RobotFault
from shared.messages.topics import TRACKER_RAW
from shared.runtime.serve import ServeArgs
from shared.testing.fake_vive.runtime import OVERRIDE, FakeVive
from tests.integration.vive.conftest import SERIAL
from tests.unit.calibration.making import calibration, write

GRIP = 0.1
"""From the tracker to the bat's frame, along the tracker's z (m)."""


class Watched:
    """A tracker that is read a hundred times a second, as the loop does."""

    def __init__(self, tracker: ViveTracker) -> None:
        self.tracker = tracker
        self.seen: list[TrackedBat] = []
        self.longest = 0.0

    def until(self, condition: Callable[[], bool], seconds: float = 5.0) -> float:
        """Read until something is so; return how long that took."""
        began = time.monotonic()
        while time.monotonic() - began < seconds:
            before = time.monotonic()
            self.seen.append(self.tracker.read(before))
            self.longest = max(self.longest, time.monotonic() - before)
            if condition():
                return time.monotonic() - began
            time.sleep(0.01)
        raise AssertionError(f"not within {seconds} s: {self.seen[-1]}")

    @property
    def last(self) -> TrackedBat:
        return self.seen[-1]


@pytest.fixture
def watched(vive: FakeVive, tmp_path: Path) -> Iterator[Watched]:
    path = write(tmp_path / "vive.toml", calibration())
    clock = SystemClock()
    cfg = ViveConfig(serial=SERIAL, calibration=str(path), mount_position=(0.0, 0.0, GRIP))
    tracker = open_vive(cfg, IDENTITY, IDENTITY, MemoryHub(clock).join("robot-io-0"), clock)
    yield Watched(tracker)
    tracker.close()


class Metronome:
    """Counts how often a process of nothing but 4 ms pauses gets its turn on this machine."""

    def __enter__(self) -> "Metronome":
        script = (
            "import time\n"
            "due = time.monotonic()\n"
            "while True:\n"
            "    due = max(due + 0.004, time.monotonic() + 0.002)\n"
            "    time.sleep(max(due - time.monotonic(), 0.0))\n"
            "    print(flush=True)\n"
        )
        self._process = subprocess.Popen(
            [sys.executable, "-c", script], stdout=subprocess.PIPE, bufsize=0
        )
        assert self._process.stdout is not None
        os.set_blocking(self._process.stdout.fileno(), False)
        self._since, self._rate = time.monotonic(), 250.0
        return self

    def fair_rate(self) -> float:
        """Return nine tenths of its rate over the last second or so."""
        assert self._process.stdout is not None
        passed = time.monotonic() - self._since
        if passed >= 1.0:
            beats = self._process.stdout.read(65536) or b""
            self._since, self._rate = time.monotonic(), len(beats) / passed
        return 0.9 * min(self._rate, 250.0)

    def __exit__(self, *error: object) -> None:
        self._process.kill()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()


def at(x: float, y: float = 0.0, z: float = 1.0) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = (x, y, z)
    return matrix


def test_poses_come_250_times_a_second_and_make_a_bat(vive: FakeVive, watched: Watched):
    vive.put(2, SERIAL, at(0.3), battery=0.42)
    watched.until(lambda: watched.last.is_valid)
    with Metronome() as metronome:
        watched.until(
            lambda: watched.tracker.rates()["tracker_polls_per_s"] > metronome.fair_rate(), 30.0
        )
    rates, counters = watched.tracker.rates(), watched.tracker.counters()
    assert rates["tracker_polls_per_s"] < 260.0
    assert rates["tracker_battery_percent"] == pytest.approx(42.0)
    assert rates["tracker_connected"] == 1.0
    assert watched.last.state[:3] == pytest.approx([0.3, 0.0, 1.0 + GRIP])
    assert watched.last.problem == ""
    assert counters["tracker_poses_lost"] == 0
    assert "mm on poses held out" in watched.last.passed[0]


def test_a_bat_that_moves_has_its_speed(vive: FakeVive, watched: Watched):
    stop = threading.Event()

    def move() -> None:
        began = time.monotonic()
        while not stop.wait(0.001):
            vive.put(2, SERIAL, at(0.4 * (time.monotonic() - began) - 2.0))

    def has_speed() -> bool:
        lately = watched.seen[-30:]
        speeds = [bat.state[7] for bat in lately if bat.is_valid]
        return len(speeds) == 30 and bool(np.abs(np.median(speeds) - 0.4) < 0.05)

    mover = threading.Thread(target=move)
    mover.start()
    try:
        watched.until(has_speed, 9.0)
    finally:
        stop.set()
        mover.join()


def test_a_dropout_is_lost_in_a_tenth_of_a_second_and_proven_again_in_a_fifth(
    vive: FakeVive, watched: Watched
):
    vive.put(2, SERIAL, at(0.3))
    watched.until(lambda: watched.last.is_valid)
    vive.put(2, SERIAL, at(0.3), result=201)
    assert watched.until(lambda: not watched.last.is_valid) < 0.16
    assert "the base stations have lost the tracker" in watched.last.problem
    assert "(result 201)" in watched.last.problem
    vive.put(2, SERIAL, at(0.31))
    took = watched.until(lambda: watched.last.is_valid)
    assert 0.19 < took < 0.35
    counters = watched.tracker.counters()
    assert counters["tracker_dropouts"] == 1
    assert counters["tracker_bad_poses"] > 10


def test_one_that_is_switched_off_is_told_so(vive: FakeVive, watched: Watched):
    watched.until(lambda: watched.last.is_valid)
    vive.put(2, SERIAL, is_connected=False, is_valid=False, result=1)
    watched.until(lambda: not watched.last.is_valid)
    assert watched.last.problem == f"the tracker {SERIAL} is switched off or out of reach"
    assert watched.tracker.rates()["tracker_connected"] == 0.0


def test_a_jump_is_not_believed_until_it_has_lasted(vive: FakeVive, watched: Watched):
    vive.put(2, SERIAL, at(0.3))
    watched.until(lambda: watched.last.is_valid)
    before = watched.tracker.counters()["tracker_rejected"]
    vive.put(2, SERIAL, at(0.6))
    watched.until(lambda: not watched.last.is_valid, 0.5)
    assert watched.tracker.counters()["tracker_rejected"] == before + 1
    watched.until(lambda: watched.last.is_valid)
    assert watched.last.state[0] == pytest.approx(0.6)


def test_one_that_flies_off_is_not_there(vive: FakeVive, watched: Watched):
    watched.until(lambda: watched.last.is_valid)
    vive.put(2, SERIAL, at(7.0))
    watched.until(lambda: not watched.last.is_valid)
    assert watched.tracker.counters()["tracker_flown"] > 0


def test_a_wrong_serial_lists_those_that_are_seen_and_one_that_comes_later_is_found(
    vive: FakeVive, watched: Watched
):
    watched.until(lambda: watched.last.is_valid)
    watched.tracker.close()
    vive.put(2, "LHR-00000009")
    clock = SystemClock()
    cfg = ViveConfig(serial=SERIAL, calibration="none")
    tracker = open_vive(cfg, IDENTITY, IDENTITY, MemoryHub(clock).join("robot-io-0"), clock)
    try:
        late = Watched(tracker)
        late.until(lambda: bool(late.last.problem))
        assert late.last.problem == (
            f"no tracker {SERIAL}; SteamVR sees LHR-00000009 (VIVE Tracker 3.0)"
        )
        vive.put(3, SERIAL)
        late.until(lambda: late.last.problem.startswith("no calibration none"))
        assert not late.last.is_valid
        assert "riposte robot calibrate" in late.last.problem
    finally:
        tracker.close()


def test_raw_poses_are_said_without_a_calibration(vive: FakeVive, tmp_path: Path):
    vive.put(2, SERIAL, at(0.3, 0.4))
    clock = SystemClock()
    hub = MemoryHub(clock)
    raws = hub.join("bench").subscribe(TRACKER_RAW)
    cfg = ViveConfig(serial=SERIAL, calibration=str(tmp_path / "none.toml"))
    tracker = open_vive(cfg, IDENTITY, IDENTITY, hub.join("robot-io-0"), clock)
    try:
        uncalibrated = Watched(tracker)
        heard = []
        uncalibrated.until(lambda: (raw := raws.take()) is not None and not heard.append(raw))
        assert heard[0].pose[:3] == pytest.approx([0.3, 0.4, 1.0])
        assert heard[0].is_valid
        assert heard[0].serial == SERIAL
    finally:
        tracker.close()


def test_steamvr_that_ends_is_joined_again_when_it_is_back(vive: FakeVive, watched: Watched):
    watched.until(lambda: watched.last.is_valid)
    vive.refuse(121)
    vive.quit()
    watched.until(lambda: watched.last.problem.startswith("SteamVR is not running"))
    assert not watched.last.is_valid
    vive.refuse(0)
    watched.until(lambda: watched.last.is_valid)
    assert watched.tracker.counters()["steamvr_opened"] == 2
    assert vive.counted()["cleaned"] == 1


def test_a_steamvr_that_never_will_do_is_refused_at_once(vive: FakeVive, tmp_path: Path):
    vive.age()
    clock = SystemClock()
    with pytest.raises(RobotFault, match="update SteamVR"):
        open_vive(ViveConfig(serial=SERIAL), IDENTITY, IDENTITY, MemoryHub(clock).join("r"), clock)
    assert not any(thread.name == "vive" for thread in threading.enumerate())


def child_of(watched: Watched) -> "subprocess.Popen[bytes]":
    source = watched.tracker._source
    assert isinstance(source, ViveChild)
    assert source._child is not None
    return source._child


def until_stopped(pid: int) -> None:
    stat = Path(f"/proc/{pid}/stat")
    until = time.monotonic() + 5.0
    while stat.read_text().rpartition(")")[2].split()[0] != "T":
        assert time.monotonic() < until
        time.sleep(0.001)


def test_a_steamvr_that_hangs_holds_up_nobody_and_its_process_is_replaced_when_it_crashes(
    vive: FakeVive, watched: Watched
):
    vive.put(2, SERIAL, at(0.3))
    watched.until(lambda: watched.last.is_valid)
    watched.until(lambda: watched.tracker.counters()["tracker_polls"] > 10)
    watched.longest = 0.0
    child = child_of(watched)
    child.send_signal(signal.SIGSTOP)
    assert watched.until(lambda: not watched.last.is_valid) < 0.2
    watched.until(lambda: bool(watched.last.problem))
    assert watched.last.problem == "no pose of the tracker arrives: restart SteamVR"
    assert watched.longest < 0.05
    before = watched.tracker.counters()
    child.kill()
    watched.until(lambda: "has ended" in watched.last.problem)
    watched.until(lambda: watched.last.is_valid, 10.0)
    after = watched.tracker.counters()
    assert after["tracker_restarts"] == 1
    assert after["tracker_polls"] >= before["tracker_polls"] > 10
    assert child_of(watched).pid != child.pid


def test_its_process_ends_with_the_tracker_even_while_it_is_stuck(vive: FakeVive, watched: Watched):
    watched.until(lambda: watched.last.is_valid)
    child = child_of(watched)
    child.send_signal(signal.SIGSTOP)
    until_stopped(child.pid)
    watched.tracker.close()
    assert child.wait(5.0) == -signal.SIGKILL


def test_a_site_that_wants_a_tracker_on_a_machine_without_steamvr_is_refused_in_one_line(
    vive: FakeVive, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv(OVERRIDE, str(tmp_path / "nothing"))
    clock = SystemClock()
    args = ServeArgs(
        role="robot-io", site=None, name="robot-io-0", run=tmp_path, run_id="r",
        overrides=("robot_io.tracker=vive", "vive.serial=LHR-1"),
    )  # fmt: skip
    with pytest.raises(RobotFault) as caught:
        build(args, MemoryHub(clock).join("robot-io-0"), clock)
    assert str(caught.value).startswith("SteamVR is not installed for this user (openvr error 110")
    assert "\n" not in str(caught.value)
