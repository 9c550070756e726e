from pathlib import Path

import numpy as np
import pytest

from services.robot_io.poses import Pose
from services.robot_io.trackers import Follower, ReplayTracker
from shared.errors import ConfigError

START = Pose((0.5, 0.0, 1.0), (1.0, 0.0, 0.0, 0.0))


def followed(seconds: float, speed: float = 1.0) -> tuple[Follower, float]:
    follower, at = Follower(START), 10.0
    for tick in range(round(seconds * 100)):
        at = 10.0 + tick * 0.01
        follower.offer(Pose((0.5, speed * (at - 10.0), 1.0), START.orientation), at)
    return follower, at


def test_a_bat_counts_after_a_fifth_of_a_second():
    follower, at = followed(0.15)
    assert not follower.read(at).is_valid
    follower, at = followed(0.3)
    assert follower.read(at).is_valid
    assert follower.read(at).state[7:10] == pytest.approx([0.0, 1.0, 0.0], abs=1e-4)


def test_a_short_gap_is_bridged_and_a_long_one_is_not():
    follower, at = followed(0.4)
    y = follower.read(at).state[1]
    assert follower.read(at + 0.03).state[1] - y == pytest.approx(0.03, abs=1e-4)
    assert follower.read(at + 0.09).is_valid
    assert not follower.read(at + 0.11).is_valid


def test_a_jump_is_not_believed_until_it_has_lasted():
    follower, at = followed(0.4, speed=0.0)
    there = Pose((0.5, 0.3, 1.0), START.orientation)
    follower.offer(there, at + 0.01)
    assert follower.rejected == 1
    assert not follower.read(at + 0.01).is_valid
    for tick in range(2, 23):
        follower.offer(there, at + tick * 0.01)
    assert follower.read(at + 0.22).is_valid
    assert follower.read(at + 0.22).state[1] == pytest.approx(0.3)


def test_what_is_no_pose_is_left():
    follower, at = followed(0.4)
    before = follower.read(at).state
    follower.offer(Pose((float("nan"), 0.0, 0.0), START.orientation), at + 0.01)
    follower.offer(Pose((0.5, 0.0, 1.0), (0.0, 0.0, 0.0, 0.0)), at + 0.01)
    assert follower.rejected == 2
    assert np.array_equal(follower.read(at).state, before)


def test_turning_is_measured():
    follower = Follower(START)
    for tick in range(40):
        half = 0.5 * 2.0 * tick * 0.01
        pose = Pose(START.position, (np.cos(half), 0.0, 0.0, np.sin(half)))
        follower.offer(pose, 1.0 + tick * 0.01)
    assert follower.read(1.39).state[10:] == pytest.approx([0.0, 0.0, 2.0], abs=1e-3)


@pytest.mark.parametrize(
    ("rows", "text"),
    [
        (np.zeros((5, 3)), "expected [T, 14]"),
        (np.full((5, 14), np.nan), "unit length|not finite"),
        (np.zeros((5, 14)), "times that do not rise"),
    ],
)
def test_a_file_that_is_no_recording_is_refused(tmp_path: Path, rows: np.ndarray, text: str):
    np.save(tmp_path / "r.npy", rows)
    with pytest.raises(ConfigError) as caught:
        ReplayTracker.load(tmp_path / "r.npy")
    assert any(part in str(caught.value) for part in text.split("|"))


def test_a_missing_recording_is_one_line(tmp_path: Path):
    with pytest.raises(ConfigError, match="cannot read the recorded bat"):
        ReplayTracker.load(tmp_path / "none.npy")
