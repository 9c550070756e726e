"""Friction that turns round over a way: a spring until it slides."""

import numpy as np
import pytest

from shared.sim.plant.bristles import Bristles

WAY, LEVEL, TIMESTEP = 1e-3, 0.4, 1e-4


def slid(speed: float, distance: float, way: float = WAY, start: float = 0.0) -> list[float]:
    """Return the torque after each step of a motion at one speed (N m)."""
    bristles = Bristles(np.array([[way]]), np.array([[start]]))
    level, at = np.array([[LEVEL]]), np.array([[speed]])
    steps = round(distance / abs(speed) / TIMESTEP)
    return [float(bristles.act(level, at, TIMESTEP)[0].item()) for _ in range(steps)]


@pytest.mark.parametrize("speed", [0.05, -0.05])
def test_friction_builds_up_against_the_motion_over_its_way(speed: float):
    torque = np.array(slid(speed, 5.0 * WAY))
    way = abs(speed) * TIMESTEP * np.arange(1, len(torque) + 1)
    np.testing.assert_allclose(-np.sign(speed) * torque, LEVEL * (1.0 - np.exp(-way / WAY)))


def test_it_is_the_same_at_any_speed():
    assert slid(0.01, WAY)[-1] == pytest.approx(slid(0.1, WAY)[-1], rel=1e-6)


def test_what_moves_at_the_start_has_slid_before():
    assert slid(0.1, 1e-5, start=0.1)[0] == pytest.approx(-LEVEL, rel=1e-3)
    assert abs(slid(0.1, 1e-5, start=0.0)[0]) < 0.02 * LEVEL


def test_damping_is_what_the_torque_changes_by_in_a_step():
    bristles = Bristles(np.array([[WAY]]), np.zeros((1, 1)))
    level, speed = np.array([[LEVEL]]), np.array([[0.02]])
    for _ in range(300):
        before, damping = bristles.act(level, speed, TIMESTEP)
        after = before - damping * speed
        wanted, _ = bristles.act(level, speed, TIMESTEP)
        assert after.item() == pytest.approx(wanted.item(), abs=2e-5)


def test_a_joint_without_a_way_has_no_bristles():
    bristles = Bristles(np.array([[0.0, WAY]]), np.array([[1.0, 1.0]]))
    torque, damping = bristles.act(np.full((1, 2), LEVEL), np.full((1, 2), 0.1), TIMESTEP)
    assert bristles.are_there.tolist() == [[False, True]]
    assert (torque[0, 0], damping[0, 0]) == (0.0, 0.0)
    assert torque[0, 1] < 0.0
