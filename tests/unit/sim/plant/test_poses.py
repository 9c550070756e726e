"""Rigid motions, by hand."""

import numpy as np

from shared.sim.plant.poses import (
    conjugate,
    frame,
    inverse,
    product,
    rotated,
    rotation_vectors,
    seen_from,
    turn,
)

QUARTER = turn(np.array([0.0, 0.0, np.pi / 2]))


def test_a_quarter_turn_about_z_takes_x_to_y() -> None:
    np.testing.assert_allclose(rotated(QUARTER, np.array([1.0, 0.0, 5.0])), [0, 1, 5], atol=1e-15)


def test_a_turn_is_twice_half_of_it_and_undone_by_its_conjugate() -> None:
    eighth = turn(np.array([0.0, 0.0, np.pi / 4]))
    np.testing.assert_allclose(product(eighth, eighth), QUARTER, atol=1e-15)
    np.testing.assert_allclose(product(QUARTER, conjugate(QUARTER)), [1, 0, 0, 0], atol=1e-15)


def test_the_second_rotation_of_a_product_comes_first() -> None:
    tilt = turn(np.array([np.pi / 2, 0.0, 0.0]))
    y = np.array([0.0, 1.0, 0.0])  # tilted to z, which the quarter turn leaves
    np.testing.assert_allclose(rotated(product(QUARTER, tilt), y), [0, 0, 1], atol=1e-15)


def test_a_rotation_vector_is_found_again_from_either_sign_of_its_quaternion() -> None:
    vectors = np.array([[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0], [0.1, -0.2, 0.3], [0.0, 3.1, 0.0]])
    np.testing.assert_allclose(rotation_vectors(turn(vectors)), vectors, atol=1e-12)
    np.testing.assert_allclose(rotation_vectors(-turn(vectors)), vectors, atol=1e-12)


def test_no_turn_is_the_identity_to_the_last_bit() -> None:
    np.testing.assert_array_equal(frame(np.zeros(6)), [0, 0, 0, 1, 0, 0, 0])
    pose = np.array([0.3, 0.2, 0.1, 0.5, 0.5, -0.5, 0.5])
    np.testing.assert_array_equal(seen_from(frame(np.zeros(6)), pose), pose)


def test_a_pose_in_a_frame_goes_through_it_and_back() -> None:
    rng = np.random.default_rng(1)
    frames = np.stack([frame(values) for values in rng.normal(size=(6, 6))])
    poses = np.stack([frame(values) for values in rng.normal(size=(6, 6))])
    back = seen_from(inverse(frames), seen_from(frames, poses))
    np.testing.assert_allclose(back, poses, atol=1e-12)
    moved = seen_from(frame(np.array([1.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2])), poses[0])
    np.testing.assert_allclose(moved[:3], [1 - poses[0, 1], poses[0, 0], poses[0, 2]], atol=1e-12)
