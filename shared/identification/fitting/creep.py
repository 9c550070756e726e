"""Joints that friction holds, but that creep under a load.

A plant's joints stick. MuJoCo's own do not quite: it makes friction of an impedance d, and with its
default, 0.9, what is held creeps by some mrad/s, in proportion to (1 - d) / d. Nor do those that
something shakes. Where that cannot be, a drag at low speed is named for it.
"""

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.fitting.base import BaseFits, fit_with
from shared.identification.fitting.fit import descend
from shared.identification.fitting.parameters import LOOSE, BaseParameter
from shared.identification.fitting.space import Space
from shared.sim.plant.row import Row

_DEFAULT = 1.0 / 9.0
"""(1 - d) / d of MuJoCo's default."""
_LOOKED = 0.3
"""Of that, at which is looked."""
_PLAINLY = 20.0
"""Twice what it takes off the cost, at least; in mean squares of what is left, if that is more."""
_NEARLY = 0.5
"""Of that, which a few steps with one derivative take off of what a fit does."""


def creep_of(subject: Subject) -> tuple[BaseParameter, ...]:
    """Return how much joints creep, alike for all of them; none of an arm without friction."""
    if subject.control == "pose" or not np.any(subject.nominal.model.dof_frictionloss > 0.0):
        return ()

    def change(row: Row, value: float) -> None:
        impedance = row.field("dof_solimp")[:, :2]
        impedance[:] = 1.0 / (1.0 / impedance + value)

    return (BaseParameter("friction_creep", "1", 0.0, False, _DEFAULT, 0.0, 2.0, LOOSE, change),)


def with_creep(done: BaseFits, creep: tuple[BaseParameter, ...]) -> BaseFits:
    """Return the base's fit with joints that creep, if the recordings plainly show it.

    Args:
        done: without.
        creep: from :func:`creep_of`.
    """
    if not creep:
        return done
    space = Space(done.whole.space.problem.freer(creep))
    train = space.problem.of("train")
    start = np.r_[done.whole.z, _LOOKED]
    plainly = _PLAINLY * max(1.0, 2.0 * done.whole.cost / len(done.whole.residual))
    if _expected(done, space.residual([start], train)[0]) < plainly:
        return done
    down = descend(space, [start], done.whole.jacobian, train, done.whole.z.size)
    if 2.0 * (done.whole.cost - down.cost) < _NEARLY * plainly:
        return done
    found = fit_with(space, done, down.z[done.whole.z.size :])
    return found if 2.0 * (done.whole.cost - found.whole.cost) > plainly else done


def _expected(done: BaseFits, residual: Float64) -> float:
    """Return twice what it takes off the cost at its best, as far as one look says.

    Args:
        done: the base without it.
        residual: float64[M + n + 1], as it is with some.
    """
    rows = len(done.whole.residual) - done.whole.z.size
    basis = np.linalg.qr(done.whole.jacobian)[0]
    moved = np.zeros(len(done.whole.residual))
    moved[:rows] = residual[:rows] - done.whole.residual[:rows]
    moved -= basis @ (basis.T @ moved)
    along = -float(moved @ done.whole.residual)
    return max(along, 0.0) ** 2 / max(float(moved @ moved), 1e-12)
