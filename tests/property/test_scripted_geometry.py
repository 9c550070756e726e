"""The geometry of the scripted players against slow literal versions, for any input."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from shared.game.geometry import BatShape
from shared.policy.scripted.blades import across, tangent_back, turn_between, turned, unit
from shared.policy.scripted.guard import meeting_point
from shared.policy.scripted.heuristic import closest_share
from shared.policy.scripted.reaching import (
    ARM,
    PEAK_OVER_MEAN,
    SHOULDER,
    minimum_jerk,
    noisy,
    within_reach,
)
from tests.unit.game.literal import end_points, point_to_segment

Floats = NDArray[np.float64]
SEEDS = st.integers(0, 2**32 - 1)
BAT = BatShape()
LENGTH = BAT.front - BAT.back
UP = np.array([0.0, 0.0, 1.0])


def directions(generator: np.random.Generator, count: int) -> Floats:
    return unit(generator.normal(size=(3, count)))


def angles(a: Floats, b: Floats) -> Floats:
    """Between unit vectors (rad); exact for small angles too."""
    return 2.0 * np.arctan2(np.linalg.norm(a - b, axis=0), np.linalg.norm(a + b, axis=0))


def rotation_matrix(vector: Floats) -> Floats:
    """The exponential of a rotation vector, by its series."""
    x, y, z = vector
    generator = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix, term = np.eye(3), np.eye(3)
    for power in range(1, 40):
        term = term @ generator / power
        matrix = matrix + term
    return matrix


@settings(deadline=None)
@given(SEEDS)
def test_a_turned_vector_is_the_exponential_of_the_rotation_applied(seed: int):
    generator = np.random.default_rng(seed)
    vectors, rotations = generator.normal(size=(3, 8)), generator.uniform(-2, 2, (3, 8))
    rotations[:, 0] = 0.0
    expected = [rotation_matrix(r) @ v for r, v in zip(rotations.T, vectors.T, strict=True)]
    np.testing.assert_allclose(turned(vectors, rotations).T, expected, atol=1e-12)


@settings(deadline=None)
@given(SEEDS)
def test_the_turn_between_two_directions_leads_from_one_to_the_other_by_the_shortest_way(seed: int):
    generator = np.random.default_rng(seed)
    start, end = directions(generator, 16), directions(generator, 16)
    start[:, 0], end[:, 1], end[:, 2] = end[:, 0], -start[:, 1], start[:, 2] + 1e-9
    turn = turn_between(start, end)
    assert (angles(turned(start, turn), end) < 1e-6).all()
    np.testing.assert_allclose(np.linalg.norm(turn, axis=0), angles(start, end), atol=1e-6)


@settings(deadline=None)
@given(SEEDS)
def test_across_is_perpendicular_and_no_other_perpendicular_is_nearer(seed: int):
    generator = np.random.default_rng(seed)
    axes, vectors = directions(generator, 16), directions(generator, 16)
    vectors[:, 0] = axes[:, 0]
    found = across(vectors, axes, UP)
    np.testing.assert_allclose((found * axes).sum(0), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(found, axis=0), 1.0, atol=1e-9)
    for angle in np.linspace(0.1, 2 * np.pi - 0.1, 12):  # all others: found, turned about the axis
        other = turned(found, angle * axes)
        assert ((found * vectors).sum(0) >= (other * vectors).sum(0) - 1e-9).all()


@settings(deadline=None)
@given(SEEDS)
def test_random_turns_leave_the_perpendicular_by_at_most_25_degrees_times_root_three(seed: int):
    generator = np.random.default_rng(seed)
    axes = directions(generator, 64)
    offsets = np.deg2rad(25.0) * generator.uniform(-1, 1, (3, 64))
    blades = turned(across(directions(generator, 64), axes, UP), offsets)
    off = np.abs(np.arcsin(np.clip((blades * axes).sum(0), -1.0, 1.0)))
    assert (off <= np.deg2rad(25.0 * math.sqrt(3.0)) + 1e-12).all()


@settings(deadline=None)
@given(SEEDS)
def test_the_geometric_share_is_where_a_search_along_the_bat_comes_nearest_to_the_target(seed: int):
    generator = np.random.default_rng(seed)
    grips, blades = generator.normal(0.0, 0.6, (3, 16)), directions(generator, 16)
    low, up = grips + BAT.back * blades, grips + BAT.front * blades
    shares = closest_share(low, up, LENGTH, "geometric")
    points = low + shares * (up - low)
    tried = low[:, None] + np.linspace(0.0, 1.0, 2001)[None, :, None] * (up - low)[:, None]
    best = np.linalg.norm(tried, axis=0).min(axis=0)
    assert (np.linalg.norm(points, axis=0) <= best + 1e-9).all()
    for grip, blade, point in zip(grips.T, blades.T, points.T, strict=True):
        ends = end_points(tuple(grip), tuple(blade), BAT.back, BAT.front)
        assert math.dist(point, (0, 0, 0)) == pytest.approx(point_to_segment((0, 0, 0), *ends))


@settings(deadline=None)
@given(SEEDS)
def test_the_printed_share_is_the_papers_formula_number_by_number(seed: int):
    generator = np.random.default_rng(seed)
    low = generator.normal(0.0, 0.6, (3, 16))
    up = low + LENGTH * directions(generator, 16)
    expected: list[float] = []
    for lo, hi in zip(low.T, up.T, strict=True):
        product = sum((0.0 - float(a)) * (float(b) - float(a)) for a, b in zip(lo, hi, strict=True))
        expected.append(max(0.0, min(1.0, product / (2 * LENGTH))))
    np.testing.assert_allclose(closest_share(low, up, LENGTH, "printed"), expected, atol=1e-12)


def test_both_shares_by_hand_for_a_bat_that_lies_on_the_x_axis():
    """Ends at -0.5 and 0.25: the target is two thirds up; the print has 0.5 * 0.75 / 1.5."""
    low, up = np.array([[-0.5], [0.1], [0.0]]), np.array([[0.25], [0.1], [0.0]])
    assert closest_share(low, up, 0.75, "geometric")[0] == pytest.approx(2 / 3)
    assert closest_share(low, up, 0.75, "printed")[0] == pytest.approx(0.25)


@settings(deadline=None)
@given(SEEDS, st.floats(0.1, 0.4))
def test_a_tangent_touches_the_sphere_and_does_not_cut_it(seed: int, radius: float):
    generator = np.random.default_rng(seed)
    outward, distance = directions(generator, 16), radius * generator.uniform(1.01, 3.0)
    points = distance * outward
    sideways = across(directions(generator, 16), outward, UP)
    back = tangent_back(outward, distance, radius, sideways)
    np.testing.assert_allclose(np.linalg.norm(back, axis=0), 1.0, atol=1e-9)
    along = -(points * back).sum(0)
    np.testing.assert_allclose(np.linalg.norm(points + along * back, axis=0), radius, atol=1e-9)
    assert ((points + along * back) * sideways).sum(0).min() > 0.0


@settings(deadline=None)
@given(SEEDS)
def test_blades_meet_on_the_way_in_of_the_blade_that_comes(seed: int):
    generator = np.random.default_rng(seed)
    grips = directions(generator, 32) * generator.uniform(0.5, 1.2, 32)
    blades = directions(generator, 32)
    radius = 0.375
    points = meeting_point(grips, blades, BAT, radius)
    for grip, blade, point in zip(grips.T, blades.T, points.T, strict=True):
        ends = end_points(tuple(grip), tuple(blade), BAT.back, BAT.front)
        nearest = point_to_segment((0.0, 0.0, 0.0), *ends)
        assert math.dist(point, (0, 0, 0)) == pytest.approx(radius)
        if nearest < radius:  # on the line of the blade, between the grip and the nearest point
            assert np.linalg.norm(np.cross(point - grip, blade)) == pytest.approx(0.0, abs=1e-6)
            assert (point - grip) @ blade <= -(grip @ blade) + 1e-6


def test_minimum_jerk_starts_and_ends_at_rest_and_is_fastest_in_the_middle():
    times = np.linspace(-0.2, 1.2, 1401)
    way = minimum_jerk(times)
    speed = np.gradient(way, times)
    assert way[0] == 0.0
    assert way[-1] == 1.0
    assert speed.max() == pytest.approx(PEAK_OVER_MEAN, rel=1e-4)
    assert times[speed.argmax()] == pytest.approx(0.5, abs=2e-3)
    assert np.abs(np.gradient(speed, times)[[200, 1200]]).max() < 0.1
    np.testing.assert_allclose(minimum_jerk(times) + minimum_jerk(1.0 - times), 1.0, atol=1e-12)


@settings(deadline=None)
@given(SEEDS)
def test_a_hand_stays_within_the_arms_length_and_moves_only_if_it_was_beyond(seed: int):
    grips = np.random.default_rng(seed).normal(0.0, 1.0, (3, 32))
    shoulder = np.array(SHOULDER)[:, None]
    reached = within_reach(grips)
    before = np.linalg.norm(grips - shoulder, axis=0)
    after = np.linalg.norm(reached - shoulder, axis=0)
    np.testing.assert_allclose(after, np.minimum(before, ARM), atol=1e-12)
    np.testing.assert_allclose(reached[:, before <= ARM], grips[:, before <= ARM], atol=1e-12)


def test_the_noise_of_a_command_grows_with_the_command():
    generator = np.random.default_rng(5)
    sizes = np.array([0.0, 0.25, 0.5, 1.0, 4.0])
    actions = np.zeros((len(sizes), 20_000, 6), np.float32)
    actions[:, :, 0] = actions[:, :, 4] = sizes[:, None]
    out = noisy(actions.reshape(-1, 6), 0.2, generator).reshape(actions.shape)
    bounded = np.minimum(sizes, 1.0)
    np.testing.assert_allclose(out.std(axis=1)[:, 0], 0.2 * bounded, rtol=0.03)
    np.testing.assert_allclose(out.std(axis=1)[:, 5], 0.2 * bounded, rtol=0.03)
    np.testing.assert_allclose(out.mean(axis=1)[:, 4], bounded, atol=0.01)
