"""How fast an arm starts, by its first readings."""

import numpy as np
import pytest

from shared.identification.dataset.beginnings import (
    first_velocities,
    logged_velocities,
    surely_moving,
)
from shared.identification.dataset.types import Float64

_AT = np.arange(100) / 100.0


def test_the_speed_of_a_start_in_motion_is_taken_whatever_it_does_next():
    q = np.stack([0.7 * _AT, -1.3 * _AT + 8.0 * _AT**2], axis=1)
    noisy = q + np.random.default_rng(0).normal(0.0, 1e-4, q.shape)
    velocity, error = first_velocities(_AT, noisy)
    assert velocity == pytest.approx([0.7, -1.3], abs=0.01)
    assert (error < 0.01).all()
    assert surely_moving(_AT, noisy) == pytest.approx(velocity)


def test_an_arm_that_rests_is_not_set_in_motion_by_its_noise():
    rng = np.random.default_rng(1)
    for spread in (1e-4, 1e-3, 1e-2):
        moved = [surely_moving(_AT, rng.normal(0.0, spread, (100, 7))) for _ in range(100)]
        assert np.mean(np.array(moved) != 0.0) < 0.005


def test_an_arm_that_sets_off_late_starts_at_rest():
    late = np.maximum(_AT - 0.03, 0.0)
    assert not surely_moving(_AT, (10.0 * late**2)[:, None]).any()


def test_of_three_readings_nothing_is_sure():
    at = _AT[:3]
    assert not surely_moving(at, np.stack([at, 3.0 * at], axis=1)).any()


def logged(rng: np.random.Generator, q: Float64, qd: Float64) -> float:
    """Return a joint's first velocity from readings every 4 ms, those of speed worse by far."""
    at = np.arange(len(q)) / 250.0
    noise = rng.standard_normal((2, len(q)))
    found = logged_velocities(at, (q + 6e-5 * noise[0])[:, None], (qd + 6e-3 * noise[1])[:, None])
    return float(found[0])


def test_an_arm_that_rests_does_not_set_off_by_one_noisy_speed():
    rng, still = np.random.default_rng(2), np.zeros(500)
    found = np.array([logged(rng, still, still) for _ in range(300)])
    assert np.mean(found != 0.0) < 0.02
    assert np.abs(found).max() < 6e-3


def test_a_logged_start_in_motion_is_known_better_than_by_one_reading():
    rng, at = np.random.default_rng(3), np.arange(500) / 250.0
    q, qd = 0.3 * np.sin(2.0 * at), 0.6 * np.cos(2.0 * at)
    off = np.array([logged(rng, q, qd) for _ in range(100)]) - 0.6
    assert np.sqrt(np.mean(off**2)) < 3e-3


def test_where_no_cubic_fits_the_first_logged_velocity_is_taken_as_it_is():
    at = np.arange(500) / 250.0
    qd = np.where(at < 0.008, 0.5, -0.5) + 1e-3 * np.sin(9.0 * at)
    q = np.cumsum(qd) / 250.0
    assert logged_velocities(at, q[:, None], qd[:, None])[0] == qd[0]


def test_without_noise_the_first_logged_velocity_is_taken_as_it_is():
    still = np.zeros((300, 1))
    assert logged_velocities(np.arange(300) / 100.0, still, still + 0.2)[0] == 0.2
