"""What random torques make of an arm that is held by its tool."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.noise.pushed import Pushed, pushed_of, whitening
from shared.sim.plant.plant import pr2
from shared.sim.plant.rollouts import Rollouts
from tests.arms import make_plant

REST = np.array([-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46])
TRUE = Pushed(reading=3e-4, push=0.004, time=0.4)


@pytest.fixture(scope="module")
def nominal() -> Rollouts:
    return Rollouts(pr2("right", None), (), 1)


@pytest.fixture(scope="module")
def seen(nominal: Rollouts) -> tuple[np.ndarray, np.ndarray]:
    """Differences of repeats as the formula has them, and postures: float64[600, 7] each."""
    rng = np.random.default_rng(0)
    q = REST + rng.uniform(-0.2, 0.2, (600, 7))
    unit = np.sqrt(2.0) * rng.standard_normal((600, 7))
    colour = np.linalg.inv(whitening(TRUE, nominal, q))
    return np.einsum("bij,bj->bi", colour, unit), q


def test_readings_and_pushes_are_told_apart(nominal: Rollouts, seen: tuple[np.ndarray, np.ndarray]):
    found = pushed_of(nominal, [seen], np.sqrt(0.5))
    assert found is not None
    assert found.reading == pytest.approx(TRUE.reading, rel=0.1)
    assert found.push == pytest.approx(TRUE.push, rel=0.35)  # and time, which it trades against
    assert found.time in (0.2, 0.4, 0.8)


def test_whitened_residuals_are_of_unit_variance(
    nominal: Rollouts, seen: tuple[np.ndarray, np.ndarray]
):
    differences, q = seen
    found = pushed_of(nominal, [seen], np.sqrt(0.5))
    assert found is not None
    unit = np.einsum("bij,bj->bi", whitening(found, nominal, q), differences) / np.sqrt(2.0)
    assert unit.std(axis=0) == pytest.approx(np.ones(7), abs=0.15)
    raw = differences.std(axis=0)
    assert raw.max() > 10.0 * TRUE.reading  # most of it along what the tool does not show


def test_an_arm_held_by_its_joints_has_no_such_noise(tmp_path: Path):
    held = Rollouts(make_plant(tmp_path), (), 1)
    assert pushed_of(held, [(np.ones((10, 3)), np.zeros((10, 3)))], 1.0) is None
    assert pushed_of(Rollouts(pr2("right", None), (), 1), [], 1.0) is None


def test_a_joint_is_pushed_by_a_share_of_its_largest_torque(nominal: Rollouts):
    largest = TRUE.torque(nominal, "shoulder_lift"), TRUE.torque(nominal, "forearm_roll")
    assert largest == pytest.approx((0.004 * 11.64, 0.004 * 3.6), rel=0.01)
