"""The real wheel over a client library of our own: what it says, and what it refuses."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from services.robot_io.vive.device import RAW, ViveDevice
from services.robot_io.vive.source import SteamVrError
from shared.testing.fake_vive.runtime import OVERRIDE, FakeVive
from tests.integration.robot_io.site import ROOT
from tests.integration.vive.conftest import SERIAL


@pytest.fixture
def device(vive: FakeVive) -> Iterator[ViveDevice]:
    device = ViveDevice()
    yield device
    device.close()


def matrix(x: float, y: float, z: float) -> np.ndarray:
    """A quarter turn about z, somewhere."""
    return np.array([[0, -1, 0, x], [1, 0, 0, y], [0, 0, 1, z], [0, 0, 0, 1]], float)


def test_a_tracker_is_found_by_its_serial_and_asked_in_the_raw_frame(
    vive: FakeVive, device: ViveDevice
):
    vive.put(3, "LHR-other")
    vive.put(2, SERIAL, matrix(1.0, 2.0, 3.0), battery=0.5)
    assert device.open()
    assert device.find(SERIAL)
    sighting = device.poll()
    assert sighting.pose is not None
    assert sighting.pose.position == pytest.approx((1.0, 2.0, 3.0))
    assert sighting.pose.orientation == pytest.approx((0.5**0.5, 0.0, 0.0, 0.5**0.5))
    assert device.battery() == pytest.approx(0.5)
    counted = vive.counted()
    assert counted["universe"] == RAW
    assert counted["unexpected"] == 0


def test_only_a_pose_that_is_valid_good_and_connected_counts(vive: FakeVive, device: ViveDevice):
    device.open()
    device.find(SERIAL)
    for result, is_valid, is_connected, counts in (
        (200, True, True, True), (200, True, False, False), (200, False, True, False),
        (201, True, True, False), (101, True, True, False), (300, True, True, False),
        (1, True, True, False),
    ):  # fmt: skip
        vive.put(2, SERIAL, result=result, is_valid=is_valid, is_connected=is_connected)
        assert (device.poll().pose is not None) == counts, (result, is_valid, is_connected)
    vive.put(2, SERIAL, np.full((4, 4), np.nan))
    assert device.poll().pose is None
    vive.put(2, SERIAL, np.zeros((4, 4)))  # no rotation
    assert device.poll().pose is None


def test_who_is_there_is_listed_and_a_base_station_is_no_tracker(
    vive: FakeVive, device: ViveDevice
):
    device.open()
    assert not device.find("LHR-wrong")
    assert device.seen() == (f"{SERIAL} (VIVE Tracker 3.0)",)
    assert not device.find("LHB-00000001")


def test_the_end_of_steamvr_is_heard_and_acknowledged(vive: FakeVive, device: ViveDevice):
    device.open()
    assert not device.is_ending()
    vive.quit()
    assert device.is_ending()
    assert vive.counted()["acknowledged"] == 1


@pytest.mark.parametrize(
    ("number", "words", "is_final"),
    [
        (110, "SteamVR is not installed", True),
        (105, "update SteamVR", True),
        (104, "verify its files in Steam", True),
        (121, "SteamVR is not running (openvr error 121, Init_NoServerForBackgroundApp): start it",
         False),
        (108, "enable its null driver", False),
        (126, "enable its null driver", False),
        (137, "SteamVR refuses (openvr error 137, Init_RebootingBusy)", False),
    ],
)  # fmt: skip
def test_a_refused_start_says_what_to_do_in_one_line(
    vive: FakeVive, device: ViveDevice, number: int, words: str, is_final: bool
):
    vive.refuse(number)
    with pytest.raises(SteamVrError) as caught:
        device.open()
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
    assert caught.value.is_final == is_final
    vive.refuse(0)  # a second try in the same process works
    device.open()
    assert device.find(SERIAL)


def test_a_steamvr_older_than_the_wheel_is_to_be_updated(vive: FakeVive, device: ViveDevice):
    vive.age()
    with pytest.raises(SteamVrError, match=r"older than this openvr .*105.*: update SteamVR"):
        device.open()


def test_no_steamvr_at_all_ends_robot_io_with_one_line(tmp_path: Path):
    pytest.importorskip("openvr")
    done = subprocess.run(
        [
            sys.executable, "-c",
            "from services.robot_io.vive.device import ViveDevice\n"
            "from shared.errors import RobotFault\n"
            "try: ViveDevice().open()\n"
            "except RobotFault as error: print(error)",
        ],
        cwd=ROOT, capture_output=True, text=True, timeout=60,
        env={**os.environ, OVERRIDE: str(tmp_path / "nothing")},
    )  # fmt: skip
    assert done.stdout == (
        "SteamVR is not installed for this user (openvr error 110, Init_PathRegistryNotFound): "
        "install it, start it once\n"
    )
