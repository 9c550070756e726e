"""How fast an arm starts, by its first readings."""

import numpy as np
import pytest

from shared.identification.dataset.beginnings import first_velocities, surely_moving

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
