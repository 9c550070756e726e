"""Whether drives of a model file are at their limits where the arm's are not.

A data-sheet tells the torque that a servo may give for long; for a second it gives more. A limit
that is higher than the arm's is found by ``torque_saturation``, one that is lower is not: what the
file says is the most there is, and other causes stand in for it. So it is asked what the base
leaves without it.
"""

from collections.abc import Sequence

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from shared.sim.plant.plant import unlimited

_REACHED = 0.1
"""What held-out motion changes by where a limit is reached, in noise floors (RMS)."""
_BESIDE = 0.3
"""Of what the joint whose limit changes most of it does, from which another is told, too."""
_MUCH = 1.5
"""Mean square residual of held-out motion, in noise floors, below which nothing is asked."""
_LESS = 0.5
"""Share of it that is left without the limits, at most, where these are not the arm's."""


def low_limits(fit: Fit) -> tuple[str, ...]:
    """Return the joints whose drives' limits are lower than the arm's; none of a PR2's.

    Args:
        fit: of a model without causes.
    """
    problem = fit.space.problem
    subject, test = problem.subject, problem.of("test")
    if subject.control == "pose":  # what a PR2's motors give is known
        return ()
    before = _off(problem, fit, test)
    had = float(np.mean(before**2))
    if had < _MUCH:
        return ()
    free = problem.with_plant(unlimited(subject.plant, subject.joints))
    if _change(before, _off(free, fit, test)) < _REACHED:
        return ()
    without = polish(Space(free), fit.z, problem.of("train"), steps=3)
    if np.mean(_off(free, without, test) ** 2) > _LESS * had:
        return ()
    plants = {label: unlimited(subject.plant, (label,)) for label in subject.joints}
    changes = {
        label: _change(before, _off(problem.with_plant(plant), fit, test))
        for label, plant in plants.items()
    }
    most = max(changes.values())
    return tuple(label for label, change in changes.items() if change > _BESIDE * most)


def _off(problem: Problem, fit: Fit, test: Sequence[int]) -> Float64:
    """Return float64[R], residuals in noise floors."""
    return np.concatenate([each.ravel() for each in problem.plain(fit.variant, test)])


def _change(before: Float64, after: Float64) -> float:
    """Return by how much residuals differ (RMS)."""
    return float(np.sqrt(np.mean((before - after) ** 2)))
