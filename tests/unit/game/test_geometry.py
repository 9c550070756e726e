"""Distances in the cases a person can work out."""

import numpy as np
import pytest

from shared.game.geometry import (
    BatShape,
    Target,
    blade_direction,
    distance_between_bats,
    distance_to_target,
)
from tests.unit.game import literal

BAT = BatShape(back=0.0, front=1.0, radius=0.1)
X, Y, Z = np.eye(3)


def between(grip_a: object, direction_a: object, grip_b: object, direction_b: object) -> float:
    a, u, b, v = (
        np.asarray(vector, float)[:, None] for vector in (grip_a, direction_a, grip_b, direction_b)
    )
    return float(distance_between_bats(a, u, b, v, BAT)[0])


def test_crossing_bats_overlap_by_both_radii():
    assert between((-0.5, 0, 0), X, (0, -0.5, 0), Y) == pytest.approx(-0.2)


def test_bats_crossing_at_a_height_are_that_far_apart():
    assert between((-0.5, 0, 0.5), X, (0, -0.5, 0), Y) == pytest.approx(0.3)


def test_parallel_bats_side_by_side_are_as_far_apart_as_their_axes():
    assert between((0, 0, 0), X, (0.3, 0.5, 0), X) == pytest.approx(0.3)


def test_parallel_bats_that_point_at_each_other_touch_side_by_side():
    assert between((0, 0, 0), X, (1.5, 0.2, 0), -X) == pytest.approx(0.0)


def test_bats_in_line_are_apart_by_the_gap_between_their_caps():
    assert between((0, 0, 0), X, (1.5, 0, 0), X) == pytest.approx(0.3)
    assert between((0, 0, 0), X, (-1.5, 0, 0), X) == pytest.approx(0.3)


def test_end_caps_that_touch_are_in_contact():
    assert between((0, 0, 0), X, (1.2, 0, 0), X) == pytest.approx(0.0)
    assert between((0, 0, 0), X, (1, 0, 0.2), Z) == pytest.approx(0.0)


def test_one_bat_upon_the_other_overlaps_wholly():
    assert between((0, 0, 0), X, (0, 0, 0), X) == pytest.approx(-0.2)


def test_the_nearest_point_may_be_the_tip_of_one_and_the_middle_of_the_other():
    assert between((0.5, 0, 1.5), -Z, (0, 0, 0), X) == pytest.approx(0.3)


@pytest.mark.parametrize(
    ("grip", "expected"),
    [
        ((-0.5, 0, 0), -0.3),  # the axis runs through the centre
        ((-0.5, 0.3, 0), 0.0),  # the sides touch
        ((-1.3, 0, 0), 0.0),  # the tip touches
        ((0.8, 0, 0), 0.5),  # the grip is nearest
        ((-0.5, 0, 2.0), 1.7),
    ],
)
def test_distance_to_the_target_is_between_surfaces(grip: tuple[float, ...], expected: float):
    target = Target((0.0, 0.0, 0.0), 0.2)
    found = distance_to_target(np.array(grip)[:, None], X[:, None], BAT, target)
    assert float(found[0]) == pytest.approx(expected, abs=1e-12)


def test_the_blade_is_the_x_axis_of_the_bat():
    generator = np.random.default_rng(0)
    quaternions = generator.normal(size=(4, 5))
    quaternions /= np.linalg.norm(quaternions, axis=0)
    found = blade_direction(quaternions)
    for column in range(5):
        slow = literal.rotated_x(tuple(quaternions[:, column]))
        np.testing.assert_allclose(found[:, column], slow, atol=1e-12)
    np.testing.assert_allclose(blade_direction(np.array([1.0, 0, 0, 0])), X)


def test_worlds_and_sides_are_independent():
    generator = np.random.default_rng(1)
    grips, directions = generator.normal(size=(2, 3, 2, 4))
    directions /= np.linalg.norm(directions, axis=0)
    target = Target()
    together = distance_to_target(grips, directions, BAT, target)
    for side in range(2):
        for world in range(4):
            alone = distance_to_target(
                grips[:, side, world], directions[:, side, world], BAT, target
            )
            assert together[side, world] == alone
