"""Base parameters that are fitted only where recordings plainly show them.

What few arms have is of no use to the others: a number more that may make up for a cause.
"""

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.fitting.base import BaseFits, fit_with
from shared.identification.fitting.creep import creep_of
from shared.identification.fitting.fit import Fit, descend
from shared.identification.fitting.lead import lead_of
from shared.identification.fitting.parameters import BaseParameter
from shared.identification.fitting.space import Space

_LOOKED = 0.3
"""Coordinate at which is looked."""
_PLAINLY = 20.0
"""Twice what it takes off the cost, at least; in mean squares of what was left, if that is more."""
_NEARLY = 0.5
"""Of that, which a few steps with one derivative take off of what a fit does."""


def if_shown(subject: Subject) -> tuple[BaseParameter, ...]:
    """Return what an arm may have, in the order in which it is asked for."""
    return (*lead_of(subject), *creep_of(subject))


def with_shown(done: BaseFits, parameters: tuple[BaseParameter, ...]) -> BaseFits:
    """Return the base's fit with those of some parameters that the recordings plainly show.

    Args:
        done: without.
        parameters: from :func:`if_shown`.
    """
    likely = tuple(each for each in parameters if _is_likely(done, each))
    found = _fit_with(done, likely)
    shown = tuple(each for each in likely if _is_shown(found.whole, each, done.whole))
    if shown != likely:
        found = _fit_with(done, shown)
    others = tuple(each for each in parameters if each not in likely)
    return with_shown(found, others) if shown and others else found


def _fit_with(done: BaseFits, more: tuple[BaseParameter, ...]) -> BaseFits:
    """Return the base's fit with more parameters; as it is if there are none."""
    if not more:
        return done
    space = Space(done.whole.space.problem.freer(more))
    return fit_with(space, done, np.full(len(more), _LOOKED))


def _is_likely(done: BaseFits, parameter: BaseParameter) -> bool:
    """Return whether a look, and a few steps with one derivative, say that it takes much off."""
    space = Space(done.whole.space.problem.freer((parameter,)))
    train, plainly = space.problem.of("train"), _plainly(done.whole)
    start = np.r_[done.whole.z, _LOOKED]
    if _expected(done, space.residual([start], train)[0]) < plainly:
        return False
    down = descend(space, [start], done.whole.jacobian, train, done.whole.z.size)
    return 2.0 * (done.whole.cost - down.cost) > _NEARLY * plainly


def _is_shown(fit: Fit, parameter: BaseParameter, without: Fit) -> bool:
    """Return whether a fit would surely be worse without one of its parameters.

    Args:
        fit: with it.
        parameter: which.
        without: the fit that says what sure is.
    """
    index = [each.name for each in fit.space.problem.parameters].index(parameter.name)
    return float(fit.z[index]) ** 2 > _plainly(without) * float(fit.spread[index, index])


def _plainly(fit: Fit) -> float:
    """Return what a parameter has to take off twice a fit's cost."""
    return _PLAINLY * max(1.0, 2.0 * fit.cost / len(fit.residual))


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
