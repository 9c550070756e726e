"""Torques that need no step loop: the simulator's own friction and springs, added to what is there.

Values 0 change nothing, and several effects at one joint add up.
"""

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.plant.row import Row

_LOOSE = 1e-9
"""Stiffness of a spring that only has to push (N m/rad, N/m)."""


def add_friction(row: Row, label: str, amount: float) -> None:
    """Let a joint rub by a constant amount (N m, N)."""
    if amount:
        row.field("dof_frictionloss")[row.dof(label)] += amount


def add_spring(row: Row, label: str, stiffness: float, torque: float) -> None:
    """Add ``torque - stiffness * q`` at a joint (N m/rad and N m, N/m and N).

    MuJoCo's spring is ``stiffness * (rest - q)``; a torque alone is a very soft one, far off.
    """
    if not stiffness and not torque:
        return
    joint = row.mj_joint(row.plant.mj_joint(label))
    place = int(row.model.jnt_qposadr[joint])
    stiffnesses, rests = row.field("jnt_stiffness"), row.field("qpos_spring")
    at_zero = stiffnesses[joint] * rests[place] + torque
    stiffnesses[joint] += stiffness or (_LOOSE if stiffnesses[joint] == 0.0 else 0.0)
    rests[place] = at_zero / stiffnesses[joint]


def at_joint(row: Row, label: str, *values: float) -> Float64:
    """Return float64[len(values) * J]: each value at its joint, 0 at the others."""
    out = np.zeros((len(values), len(row.plant.labels)))
    out[:, row.plant.labels.index(label)] = values
    return out.ravel()
