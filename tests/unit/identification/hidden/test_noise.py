import numpy as np
import pytest

from shared.identification.hidden import noise
from shared.identification.hidden.noise import NoiseLevels
from shared.sim.plant.signals import pose_error

LEVELS = NoiseLevels()


def rng():
    return np.random.default_rng(7)


def test_coloured_noise_has_unit_variance_and_the_memory_that_was_asked_for():
    made = noise.coloured(10_000, 3, period=0.005, memory=0.02, rng=rng())
    assert made.std(axis=0) == pytest.approx(np.ones(3), abs=0.08)
    neighbours = [np.corrcoef(column[1:], column[:-1])[0, 1] for column in made.T]
    assert neighbours == pytest.approx([np.exp(-0.25)] * 3, abs=0.02)


def test_encoders_have_the_noise_that_was_asked_for():
    at = 0.005 * np.arange(8_000)
    q = np.zeros((len(at), 2))
    read = noise.on_joints(LEVELS, at, q, rng())
    assert read.std(axis=0) == pytest.approx([0.3e-3] * 2, rel=0.1)


def test_a_tracker_has_noise_and_drift_in_position_and_rotation():
    levels = NoiseLevels(drift_memory=1.0)
    at = np.arange(9_000) / 90.0
    still = np.tile([0.5, -0.2, 0.1, 0.6, 0.8, 0.0, 0.0], (len(at), 1))
    error = pose_error(noise.on_tracker(levels, at, still, rng()), still)
    assert error.std(axis=0) == pytest.approx(levels.tracker, rel=0.1)
    assert np.linalg.norm(noise.on_tracker(levels, at, still, rng())[:, 3:], axis=1) == (
        pytest.approx(np.ones(len(at)))
    )


def test_disturbances_scale_with_the_joints_torque():
    pushed = noise.disturbance(LEVELS, np.array([10.0, 1.0]), 20_000, 5e-3, rng())
    assert pushed.std(axis=0) == pytest.approx([0.04, 0.004], rel=0.2)
