"""How sure a fitted number is, when noise is neither white nor all that is left."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtri, stdtrit

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fit import Fit
from shared.identification.gate import STRETCH
from shared.identification.problem import BLOCK

Integers = NDArray[np.intp]

CALIBRATED = 1.35
"""Times the half width of a cause's size, since no simulation is quite the arm: without it 57 of 67
intervals covered on development data, with it 62 (docs/identify.md)."""
_NOTHING = 0.01
"""What no residual changes by, in noise floors."""
_MOST_OWN = 0.9
"""Share of a stretch's own information that is taken out of the fit that judges it."""


def half_widths(fit: Fit, segments: tuple[int, ...]) -> Float64:
    """Return float64[n]: half of the 95 % interval of each coordinate.

    Args:
        fit: on the recordings ``segments``.
        segments: in the order in which the fit had them.
    """
    covariance, free = _covariance(fit, segments)
    factor = float(stdtrit(free, 0.975))
    return factor * np.sqrt(np.maximum(np.diag(covariance), 0.0))


def is_there(fit: Fit, candidate: Candidate, segments: tuple[int, ...]) -> bool:
    """Return whether a cause in a fit is surely more than nothing.

    Its first number is surely not 0; or that and those that do something without it are together:
    the two angles of a tilt, the two screws of a counterbalance, of which often only a sum is
    known. The speed over which a friction falls off is none of them.

    Args:
        fit: on the recordings ``segments``.
        candidate: one of those in it.
        segments: in the order in which the fit had them.
    """
    covariance, free = _covariance(fit, segments)
    own = np.arange(fit.space.size)[fit.space.where(candidate)]
    if _is_sure(fit.z, covariance, own[:1], free):
        return True
    amounts = own[[0, *_that_do_something(fit, candidate, segments)]]
    return len(amounts) > 1 and _is_sure(fit.z, covariance, amounts, free)


def _that_do_something(fit: Fit, candidate: Candidate, segments: tuple[int, ...]) -> list[int]:
    """Return which numbers of a cause but the first change anything by themselves."""
    own = fit.space.where(candidate)
    size = own.stop - own.start
    alone = np.tile(fit.z, (size, 1))
    alone[:, own] = np.diag(fit.z[own])
    variants = [fit.space.variant(z) for z in alone]
    kept = tuple(each for each in variants[0].extras if each[0] != candidate)
    found = fit.space.problem.vector([*variants, replace(variants[0], extras=kept)], segments)
    changed = np.abs(found[:-1] - found[-1]).max(axis=1) > _NOTHING
    return [index for index in range(1, size) if changed[index]]


def _is_sure(z: Float64, covariance: Float64, which: Integers, free: int) -> bool:
    """Return whether numbers are surely not all 0 (95 %): Hotelling's test."""
    count = len(which)
    if free <= count:
        return False
    spread = CALIBRATED**2 * covariance[np.ix_(which, which)]
    square = float(z[which] @ np.linalg.pinv(spread) @ z[which])
    return square > count * free / (free - count + 1) * float(fdtri(count, free - count + 1, 0.95))


def _covariance(fit: Fit, segments: tuple[int, ...]) -> tuple[Float64, int]:
    """Return float64[n, n], how sure a fit's coordinates are, and how much it is told from.

    It is a sandwich over stretches of ``STRETCH`` (Huber 1967, White 1982), so that
    neighbouring residuals may correlate and a misfit widens it. Each stretch's residual is taken
    as a fit without that stretch would leave it (Bell and McCaffrey 2002, CR3): a fit bends
    towards what it is judged by, the more so the fewer stretches there are to a number.
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
    free = max(n - 1, 1)
    return np.asarray(bread @ (spread.T @ spread) @ bread * free / n, np.float64), free


def _score(jacobian: Float64, residual: Float64, bread: Float64) -> Float64:
    """Return float64[n]: what one stretch pulls by, the fit being without it.

    By Woodbury's identity that is (1 - A B)^-1 g, of size n, where g is the stretch's gradient, A
    its information and B the inverse of all. A coordinate that no other stretch shows has no such
    fit; a little of its information is left in.
    """
    information = _MOST_OWN * jacobian.T @ jacobian
    left = np.eye(len(bread)) - information @ bread
    return np.asarray(np.linalg.solve(left, jacobian.T @ residual), np.float64)
