"""How sure a fitted number is, when noise is neither white nor all that is left."""

import numpy as np
from scipy.special import fdtrc, ndtri, stdtrit

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit
from shared.identification.gate.clusters import Integers, by_channel, by_stretch

CALIBRATED = 1.35
"""Times the half width of a cause's size, since no simulation is quite the arm: without it 57 of 67
intervals covered on development data, with it 62 (docs/identify_results.md)."""
SURE = float(ndtri(0.975))
"""Standard errors by which a cause is surely off nothing (95 %)."""
_NOTHING = 0.01
"""What no residual changes by, in noise floors."""
_MOST_OWN = 0.9
"""Share of a cluster's own information that is taken out of the fit that judges it."""


def half_widths(fit: Fit, segments: tuple[int, ...]) -> Float64:
    """Return float64[n]: half of the 95 % interval of each coordinate.

    Residuals say nothing of what they hardly depend on, as of a joint's damping beside a servo's,
    or of a load beside links that may be heavier themselves: what is known of the base's numbers
    beforehand says that these, and what goes with them, may still be off by so much.

    Args:
        fit: on the recordings ``segments``.
        segments: in the order in which the fit had them.
    """
    covariance, free = _covariance(fit, by_stretch(fit.space.problem, segments))
    squares = np.maximum(np.diag(covariance), np.diag(fit.spread))
    return float(stdtrit(free, 0.975)) * np.sqrt(squares)


def is_there(
    fit: Fit, candidate: Candidate, segments: tuple[int, ...], errors: float = SURE
) -> bool:
    """Return whether a cause in a fit is surely more than nothing, see :func:`sureness`.

    By so many standard errors; 95 % unless more are asked for.
    """
    return sureness(fit, candidate, segments) > errors


def sureness(fit: Fit, candidate: Candidate, segments: tuple[int, ...]) -> float:
    """Return how many standard errors a cause in a fit is off nothing by (1).

    Its first number is; or that and those that do something without it are together:
    the two angles of a tilt, the two screws of a counterbalance, of which often only a sum is
    known. The speed over which a friction falls off is none of them. Stretches may each have errors
    of their own, or each channel of a recording, as a tracker that drifts: whichever says less.

    Args:
        fit: on the recordings ``segments``.
        candidate: one of those in it.
        segments: in the order in which the fit had them.
    """
    problem = fit.space.problem
    ways = by_stretch(problem, segments), by_channel(problem, segments)
    told = [_covariance(fit, clusters) for clusters in ways if clusters]
    own = np.arange(fit.space.size)[fit.space.where(candidate)]
    first = min(_errors(fit.z, *each, own[:1]) for each in told)
    if first > SURE:
        return first
    amounts = own[[0, *_that_do_something(fit, candidate, segments)]]
    return max(first, min(_errors(fit.z, *each, amounts) for each in told))


def _that_do_something(fit: Fit, candidate: Candidate, segments: tuple[int, ...]) -> list[int]:
    """Return which numbers of a cause but the first change anything by themselves.

    How often a torque ripples changes nothing, but without it the torque does not ripple: such
    numbers keep their size, and are none of these.
    """
    problem = fit.space.problem
    is_form = candidate.forms(problem.subject)
    amounts = [index for index in range(1, len(is_form)) if not is_form[index]]
    own = fit.space.where(candidate)
    alone = np.tile(fit.z, (len(amounts) + 1, 1))
    alone[:, own] = np.where(is_form, fit.z[own], 0.0)
    for row, index in enumerate(amounts):
        alone[row, own.start + index] = fit.z[own.start + index]
    found = problem.vector([fit.space.variant(z) for z in alone], segments)
    changed = np.abs(found[:-1] - found[-1]).max(axis=1) > _NOTHING
    return [index for index, is_changed in zip(amounts, changed, strict=True) if is_changed]


def _errors(z: Float64, covariance: Float64, free: int, which: Integers) -> float:
    """Return how many standard errors numbers are off 0 by, all together: Hotelling's test.

    As a normal number has them that is as seldom so far off.
    """
    count = len(which)
    if free <= count:
        return 0.0
    spread = CALIBRATED**2 * covariance[np.ix_(which, which)]
    square = float(z[which] @ np.linalg.pinv(spread) @ z[which])
    ratio = square * (free - count + 1) / (count * free)
    seldom = max(float(fdtrc(count, free - count + 1, ratio)), np.finfo(float).tiny)
    return float(-ndtri(0.5 * seldom))


def _covariance(fit: Fit, clusters: list[Integers]) -> tuple[Float64, int]:
    """Return float64[n, n], how sure a fit's coordinates are, and how much it is told from.

    It is a sandwich over clusters of residuals (Huber 1967, White 1982), so that those
    of one may correlate and a misfit widens it. Each cluster's residual is taken
    as a fit without that cluster would leave it (Bell and McCaffrey 2002, CR3): a fit bends
    towards what it is judged by, the more so the fewer clusters there are to a number.
    """
    bread = fit.spread
    scores = [_score(fit.jacobian[each], fit.residual[each], bread) for each in clusters]
    spread = np.stack(scores)
    n = len(scores)
    free = max(n - 1, 1)
    return np.asarray(bread @ (spread.T @ spread) @ bread * free / n, np.float64), free


def _score(jacobian: Float64, residual: Float64, bread: Float64) -> Float64:
    """Return float64[n]: what one cluster pulls by, the fit being without it.

    By Woodbury's identity that is (1 - A B)^-1 g, of size n, where g is the cluster's gradient, A
    its information and B the inverse of all. A coordinate that no other cluster shows has no such
    fit; a little of its information is left in.
    """
    information = _MOST_OWN * jacobian.T @ jacobian
    left = np.eye(len(bread)) - information @ bread
    return np.asarray(np.linalg.solve(left, jacobian.T @ residual), np.float64)
