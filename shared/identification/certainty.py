"""How sure a fitted number is, when noise is neither white nor all that is left."""

from dataclasses import replace

import numpy as np
from scipy.special import stdtrit

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fit import Fit
from shared.identification.gate import STRETCH
from shared.identification.problem import BLOCK

CALIBRATED = 1.35
"""Times the half width of a cause's size, since no simulation is quite the arm: without it 57 of 67
intervals covered on development data, with it 62 (docs/identify.md)."""
_NOTHING = 0.01
"""What no residual changes by, in noise floors."""
_MOST_OWN = 0.9
"""Share of a stretch's own information that is taken out of the fit that judges it."""


def half_widths(fit: Fit, segments: tuple[int, ...]) -> Float64:
    """Return float64[n]: half of the 95 % interval of each coordinate.

    The covariance is a sandwich over stretches of ``STRETCH`` (Huber 1967, White 1982), so that
    neighbouring residuals may correlate and a misfit widens it. Each stretch's residual is taken
    as a fit without that stretch would leave it (Bell and McCaffrey 2002, CR3): a fit bends
    towards what it is judged by, the more so the fewer stretches there are to a number.

    Args:
        fit: on the recordings ``segments``.
        segments: in the order in which the fit had them.
    """
    problem = fit.space.problem
    size = round(STRETCH / BLOCK)
    bread = fit.spread
    scores: list[Float64] = []
    begin = 0
    for rows, channels in map(problem.shape_of, segments):
        count = max(rows // size, 1)
        for index in range(count):  # as np.array_split does
            end = begin + (rows // count + (index < rows % count)) * channels
            scores.append(_score(fit.jacobian[begin:end], fit.residual[begin:end], bread))
            begin = end
    spread = np.stack(scores)
    n = len(scores)
    covariance = bread @ (spread.T @ spread) @ bread * max(n - 1, 1) / n
    factor = float(stdtrit(max(n - 1, 1), 0.975))
    return factor * np.sqrt(np.maximum(np.diag(covariance), 0.0))


def is_there(fit: Fit, candidate: Candidate, segments: tuple[int, ...]) -> bool:
    """Return whether a cause in a fit is surely more than nothing.

    Its first number is surely not 0, or others are that do something without it: two angles of a
    tilt do, the speed over which a friction falls off does not.

    Args:
        fit: on the recordings ``segments``.
        candidate: one of those in it.
        segments: in the order in which the fit had them.
    """
    own = fit.space.where(candidate)
    is_sure = np.abs(fit.z[own]) > CALIBRATED * half_widths(fit, segments)[own]
    if is_sure[0] or not is_sure.any():
        return bool(is_sure[0])
    rest = fit.z.copy()
    rest[own.start] = 0.0
    others = fit.space.variant(rest)
    extras = tuple(each for each in others.extras if each[0] != candidate)
    left, none = fit.space.problem.vector([others, replace(others, extras=extras)], segments)
    return bool(np.abs(left - none).max() > _NOTHING)


def _score(jacobian: Float64, residual: Float64, bread: Float64) -> Float64:
    """Return float64[n]: what one stretch pulls by, the fit being without it.

    By Woodbury's identity that is (1 - A B)^-1 g, of size n, where g is the stretch's gradient, A
    its information and B the inverse of all. A coordinate that no other stretch shows has no such
    fit; a little of its information is left in.
    """
    information = _MOST_OWN * jacobian.T @ jacobian
    left = np.eye(len(bread)) - information @ bread
    return np.asarray(np.linalg.solve(left, jacobian.T @ residual), np.float64)
