import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from services.robot_io.poses import Pose, is_pose
from services.robot_io.vive.frames import composed, heading, inverse, pose_of_rows


def random_pose(rng: np.random.Generator) -> tuple[Pose, np.ndarray]:
    turn, place = Rotation.random(rng=rng), rng.normal(size=3)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = turn.as_matrix(), place
    pose = Pose(tuple(place), tuple(turn.as_quat(scalar_first=True)))
    return pose, matrix


def rows_of(pose: Pose) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat(pose.orientation, scalar_first=True).as_matrix()
    matrix[:3, 3] = pose.position
    return matrix


def test_composing_and_inverting_are_those_of_matrices():
    rng = np.random.default_rng(1)
    for _ in range(50):
        (one, first), (other, second) = random_pose(rng), random_pose(rng)
        assert rows_of(composed(one, other)) == pytest.approx(first @ second)
        assert rows_of(inverse(one)) == pytest.approx(np.linalg.inv(first))


def test_every_rotation_is_read_back_from_its_matrix():
    rng = np.random.default_rng(2)
    half_turns = [Rotation.from_rotvec(math.pi * axis).as_matrix() for axis in np.eye(3)]
    matrices = [Rotation.random(rng=rng).as_matrix() for _ in range(200)] + half_turns
    for turn in (*matrices, np.eye(3)):
        matrix = np.hstack([turn, [[1.0], [2.0], [3.0]]])
        pose = pose_of_rows(matrix.astype(np.float32).ravel().tolist())
        assert is_pose(pose)
        assert rows_of(pose)[:3] == pytest.approx(matrix, abs=1e-6)


def test_what_is_no_rotation_is_no_pose():
    for matrix in (
        np.zeros((3, 4)),
        np.full((3, 4), np.nan),
        np.full((3, 4), np.inf),
        -np.eye(3, 4),
    ):
        assert not is_pose(pose_of_rows(matrix.ravel().tolist()))


def test_a_heading_turns_about_the_vertical():
    pose = heading((1.0, 0.0, 0.0), math.pi / 2)
    assert composed(pose, Pose((1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))).position == pytest.approx(
        (1.0, 1.0, 0.0)
    )
