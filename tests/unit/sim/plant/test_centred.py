"""Damping in the middle of a step."""

import numpy as np
import pytest

from shared.sim.arm import Float64
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import pr2
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal

REST = np.array([-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46])


def reached(timestep: float, change: float = 1.0) -> Float64:
    """Return where the joints of a PR2 are while its tool follows a sway: float64[T, 7]."""
    plant = pr2("right", None, timestep)
    rollouts = Rollouts(plant, (), 1)
    at: Float64 = np.arange(0.0, 1.2, 0.02)
    q = REST + 0.2 * np.outer(1.0 - np.cos(2.0 * np.pi * at), np.linspace(1.0, 0.5, 7))
    command = Signal(at, tool_poses(plant, rollouts.model, q))
    recorded = Recorded(REST, np.zeros(7), command, Signal(at, q), at, None)

    def damped(row: Row) -> None:
        row.field("dof_damping")[:] *= change

    return rollouts.run([(damped, recorded)])[0].q


def test_the_error_of_a_step_is_half_of_what_it_is_with_damping_at_its_end(
    monkeypatch: pytest.MonkeyPatch,
):
    centred = float(np.abs(reached(0.0025) - reached(0.0005)).max())
    monkeypatch.setattr("shared.sim.plant.rollouts.centre", lambda row: None)
    plain = float(np.abs(reached(0.0025) - reached(0.0005)).max())
    assert centred < 0.6 * plain


def test_damping_that_would_take_all_inertia_away_stays_stable():
    stiff = reached(0.005, change=50.0)
    assert np.isfinite(stiff).all()
    assert float(np.abs(stiff - reached(0.0005, change=50.0)).max()) < 0.02
