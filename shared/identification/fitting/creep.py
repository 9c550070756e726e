"""Joints that friction holds, but that creep under a load.

A plant's joints stick. MuJoCo's own do not quite: it makes friction of an impedance d, and with its
default, 0.9, what is held creeps by some mrad/s, in proportion to (1 - d) / d. Nor do those that
something shakes. Where that cannot be, a drag at low speed is named for it.
"""

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.fitting.parameters import LOOSE, BaseParameter
from shared.sim.plant.row import Row

_DEFAULT = 1.0 / 9.0
"""(1 - d) / d of MuJoCo's default."""


def creep_of(subject: Subject) -> tuple[BaseParameter, ...]:
    """Return how much joints creep, alike for all of them; none of an arm without friction."""
    if subject.control == "pose" or not np.any(subject.nominal.model.dof_frictionloss > 0.0):
        return ()

    def change(row: Row, value: float) -> None:
        impedance = row.field("dof_solimp")[:, :2]
        impedance[:] = 1.0 / (1.0 / impedance + value)

    return (BaseParameter("friction_creep", "1", 0.0, False, _DEFAULT, 0.0, 2.0, LOOSE, change),)
