"""Commands that hold, and the same on straight lines."""

import numpy as np
import pytest

from shared.sim.plant.signals import Signal, smoothed


def test_what_moves_on_lines_is_as_late_as_what_holds_is_on_average():
    at = 0.01 * np.arange(200)
    slope = np.array([0.7, -1.3])
    smooth = smoothed(Signal(at, at[:, None] * slope), is_pose=False)
    assert np.diff(smooth.at).max() < 0.0011
    inside = (smooth.at > 0.01) & (smooth.at < 1.98)
    lag = smooth.at[inside, None] - smooth.values[inside] / slope
    assert lag == pytest.approx(0.005)


def test_poses_stay_poses():
    at = np.array([0.0, 0.1, 0.2])
    half = np.sqrt(0.5)
    poses = np.array(
        [[0.0, 0, 0, 1, 0, 0, 0], [1, 0, 0, -half, 0, 0, -half], [1, 0, 0, 0, 0, 0, 1]]
    )
    smooth = smoothed(Signal(at, poses), is_pose=True)
    assert np.linalg.norm(smooth.values[:, 3:], axis=1) == pytest.approx(1.0)
    turned = 2.0 * np.arctan2(np.abs(smooth.values[:, 6]), np.abs(smooth.values[:, 3]))
    assert np.all(np.diff(turned) > -1e-9)
    assert turned.max() == pytest.approx(np.pi)


def test_one_command_holds():
    one = Signal(np.zeros(1), np.ones((1, 3)))
    assert smoothed(one, is_pose=False) is one
