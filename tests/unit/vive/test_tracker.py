"""What is made of a tracker's poses: calibration, mounting, dock; the real wheel is elsewhere."""

import datetime
from collections.abc import Mapping
from pathlib import Path

import pytest

from services.robot_io.poses import Pose
from services.robot_io.trackers import TrackedBat
from services.robot_io.vive.calibration import Frame
from services.robot_io.vive.config import ViveConfig
from services.robot_io.vive.frames import IDENTITY
from services.robot_io.vive.source import Sample, Status
from services.robot_io.vive.tracker import ViveTracker
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.topics import TRACKER_RAW
from tests.unit.calibration.making import calibration, write

NOW = 1.7e9
DOCK = (0.4, 0.0, 1.0)


class Told:
    """A source that has what a test puts in."""

    def __init__(self) -> None:
        self.status = Status(problem="", is_connected=True, battery=0.25, polls_per_s=250.0)
        self.samples: list[Sample] = []
        self.counters: Mapping[str, int] = {"tracker_polls": 7}

    def take(self) -> list[Sample]:
        taken, self.samples = self.samples, []
        return taken

    def close(self) -> None: ...


class Seen:
    """A tracker read a hundred times a second."""

    def __init__(self, folder: Path, **changed: object) -> None:
        self.clock = ManualClock(NOW)
        made_at = datetime.datetime.fromtimestamp(NOW - 86400.0, datetime.UTC)
        path = write(folder / "vive.toml", calibration(**{"made_at": made_at, **changed}))
        self.source = Told()
        hub = MemoryHub(self.clock)
        self.raws = hub.join("bench").subscribe(TRACKER_RAW)
        cfg = ViveConfig(serial="LHR-1", calibration=str(path), mount_position=(0.0, 0.0, 0.1))
        robot = Pose((-1.0, 0.0, 0.8), (1.0, 0.0, 0.0, 0.0))
        bus = hub.join("robot-io-0")
        self.tracker = ViveTracker(cfg, self.source, robot, IDENTITY, bus, self.clock)

    def at(self, *place: float, seconds: float = 0.3) -> TrackedBat:
        """Hold the tracker there; an empty place is a lost one."""
        found = self.tracker.read(self.clock.now())
        for _ in range(round(seconds * 100)):
            self.clock.advance(0.01)
            if place:
                pose = Pose((place[0], place[1], place[2]), (1.0, 0.0, 0.0, 0.0))
                self.source.samples.append(Sample(self.clock.now(), pose))
            found = self.tracker.read(self.clock.now())
        return found


def test_a_bat_is_where_calibration_and_mounting_put_it(tmp_path: Path):
    half = 0.5**0.5
    stand = Frame(position=(0.5, 0.0, 0.0), orientation=(half, 0.0, 0.0, half))
    bat = Seen(tmp_path, torso_from_base=stand).at(0.2, 0.3, 0.1)
    # A quarter turn about z takes (0.2, 0.3) to (-0.3, 0.2).
    assert bat.state[:3] == pytest.approx([-1.0 + 0.5 - 0.3, 0.2, 0.8 + 0.1 + 0.1])
    assert bat.state[3:7] == pytest.approx([half, 0.0, 0.0, half])
    assert bat.is_valid
    assert bat.passed == (
        "the tracker is calibrated 1.0 days ago on 30 poses, 4.0 mm on poses held out",
    )


def test_a_calibration_that_is_too_old_leaves_the_bat_untracked_and_its_raw_poses_heard(
    tmp_path: Path,
):
    old = datetime.datetime.fromtimestamp(NOW - 40 * 86400.0, datetime.UTC)
    seen = Seen(tmp_path, made_at=old)
    bat = seen.at(0.2, 0.3, 0.1)
    assert not bat.is_valid
    assert bat.problem == ("calibration too old: 40.0 days, limit 30: run riposte robot calibrate")
    raw = seen.raws.take()
    assert raw is not None
    assert raw.pose[:3] == pytest.approx([0.2, 0.3, 0.1])


def test_a_bat_with_a_dock_counts_once_it_has_lain_there(tmp_path: Path):
    seen = Seen(tmp_path, dock=DOCK)
    bat = seen.at(0.1, 0.0, 1.0)
    assert not bat.is_valid
    assert bat.problem == "lay the bat into its dock for a second, to check the tracker"
    assert seen.tracker.rates()["tracker_check_due"] == 1.0
    bat = seen.at(0.4, 0.0, 1.005, seconds=0.8)
    assert bat.is_valid
    assert seen.tracker.rates()["tracker_dock_error_mm"] == pytest.approx(5.0)
    assert seen.tracker.rates()["tracker_check_due"] == 0.0

    assert not seen.at(seconds=0.25).is_valid  # lost for long
    assert seen.at(0.2, 0.0, 1.0).is_valid  # the old check counts, a new one is due
    assert seen.tracker.rates()["tracker_check_due"] == 1.0
    assert seen.tracker.counters()["tracker_dropouts"] == 1
    bat = seen.at(0.4, 0.03, 1.0, seconds=0.8)  # it has come back 3 cm off
    assert not bat.is_valid
    assert "30 mm from where that was recorded, limit 20" in bat.problem
    assert seen.tracker.counters()["dock_failures"] == 1


def test_a_short_dropout_asks_for_no_check(tmp_path: Path):
    seen = Seen(tmp_path, dock=DOCK)
    seen.at(*DOCK, seconds=0.8)
    seen.at(seconds=0.15)
    seen.at(0.3, 0.0, 1.0)
    assert seen.tracker.rates()["tracker_check_due"] == 0.0
    assert seen.tracker.counters()["tracker_dropouts"] == 1


def test_what_it_knows_of_itself_is_told(tmp_path: Path):
    seen = Seen(tmp_path)
    seen.at(0.2, 0.0, 1.0)
    assert seen.tracker.rates() == {
        "tracker_polls_per_s": 250.0, "tracker_connected": 1.0, "tracker_check_due": 0.0,
        "tracker_battery_percent": 25.0,
    }  # fmt: skip
    assert seen.tracker.counters()["tracker_polls"] == 7
    seen.source.status = Status(problem="SteamVR is not running: start it")
    assert seen.at().problem == "SteamVR is not running: start it"
