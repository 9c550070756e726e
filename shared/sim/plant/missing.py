"""Torques that a measured motion takes beyond what the model's drives give there."""

import copy

import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.inverse import missing_torques
from shared.sim.plant.row import Row


def missing_torque(row: Row, at: Float64, q: Float64, qd: Float64, qdd: Float64) -> Float64:
    """Return float64[T, J]: what else must have acted on the logged joints (N m, N).

    Inverse dynamics of the motion less what the actuators do at the measured state under the
    command that was in force. Added joints and torque laws of the row are left out.

    Args:
        row: the arm, of a batch without added joints, with its base parameters entered.
        at: float64[T], instants (s).
        q: float64[T, J] (rad, m).
        qd: float64[T, J] (rad/s, m/s).
        qdd: float64[T, J] (rad/s^2, m/s^2).
    """
    model = copy.copy(row.model)
    for name, values in row.fields.items():
        owner = model.opt if name.startswith("opt.") else model
        field = getattr(owner, name.removeprefix("opt."))
        field[...] = values.reshape(np.shape(field))
    return missing_torques(row.plant, model, q, qd, qdd, row.command.held(at))
