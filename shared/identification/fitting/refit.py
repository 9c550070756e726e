"""Fits an effect together with the whole base model, without paying for its derivative again.

A base fit that lacks the cause has bent its parameters towards it, and the way back is not
straight. So a refit begins twice, at the base's fit and at the nominal model, each with the
derivative that was computed there, and mends it as it goes (Broyden 1965); beside an accepted cause
with which hardly more than noise is left, only once. Where that derivative foretells what comes, a
refit takes none of its own. The few candidates that remain in the running get a full fit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.segments import thinned
from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import (
    BOLD,
    Fit,
    Start,
    damped,
    descend,
    go_down,
    is_nearly,
    promised,
)
from shared.identification.fitting.space import Space
from shared.identification.fitting.turns import LIKELY, NEAR, aligned, turning_of
from shared.identification.search.screen import Screened, is_steady

_MENDING = (1e-4, 1e-2, 1.0)
"""Dampings of the last step of a rough refit."""
_PARTS = (1.0, 0.5, 0.25)
"""Of the way to where the screen expects the best fit, for a start."""
_ENOUGH = 0.01


@dataclass(frozen=True)
class Rough:
    """Where a cheap refit came to."""

    screened: Screened
    space: Space
    z: Float64
    ratio: float
    """Its cost over the base's, on the recordings that were looked at."""


def refit(
    fit: Fit, nominal: Start, screened: Screened, segments: tuple[int, ...], begun: Fit
) -> Rough:
    """Return the better of two refits.

    Args:
        fit: the base's, with the causes that were accepted before.
        nominal: the derivative at the nominal model, of the base alone.
        screened: the candidate and where the screen expects it.
        segments: recordings to fit to.
        begun: where the screen looked from, in the same space as ``fit``.
    """
    space = fit.space.grown(screened.candidate)
    problem = fit.space.problem
    candidate = screened.candidate
    quantities = candidate.effect.quantities(problem.subject, candidate.place)
    is_local = candidate.recording is not None or not is_steady(problem.subject, candidate)
    picked = segments if is_local else thinned(problem.segments, segments)
    rows = problem.rows_of(segments, picked)
    extra = space.size - fit.space.size
    way: Float64 = np.concatenate([screened.shift, screened.start])
    origin: Float64 = np.concatenate([begun.z, np.zeros(extra)])
    forms = screened.candidate.forms(problem.subject)
    is_form = np.concatenate([np.zeros(fit.space.size, np.bool_), forms])
    ways: list[Float64] = []
    for part in _PARTS:
        there = origin + part * way
        there[is_form] = way[is_form]
        ways.append(space.clip(there))
    ways.append(space.clip(np.r_[begun.z, screened.start]))
    known = begun.on(rows)
    down = descend(space, ways, known.jacobian, picked, fit.space.size)
    found = [down]
    is_plain = bool(fit.space.candidates) and not any(each.phase for each in quantities)
    if not (is_plain and fit.is_near_noise):
        found.append(_from_nominal(fit, nominal, screened, picked, rows))
    best = min(found, key=lambda one: one.cost)
    z, cost = best.z, best.cost
    if best is not down or not _is_straight(known, down):
        z, cost = _mended(space, z, cost, picked)
    before = 0.5 * float(np.sum(fit.residual[: len(rows)][rows] ** 2))
    return Rough(screened, space, z, cost / max(before, 1e-12))


def _from_nominal(
    fit: Fit, nominal: Start, screened: Screened, picked: tuple[int, ...], rows: NDArray[np.bool_]
) -> Fit:
    """Return where a refit comes to that begins at the nominal model."""
    space = fit.space.grown(screened.candidate)
    is_form = screened.candidate.forms(fit.space.problem.subject)
    base = nominal.with_causes_of(fit)
    half = np.where(is_form, screened.start, 0.5 * screened.start)
    sizes = [space.clip(np.r_[base, size]) for size in (screened.start, half)]
    kept = nominal.jacobian[: len(rows)][rows]
    sizes[0] = aligned(space, sizes[0], picked, base=kept)
    return descend(space, sizes, kept, picked, nominal.z.size)


def refit_late(late: Rough, screened: Screened, fit: Fit, segments: tuple[int, ...]) -> Rough:
    """Return a refit of an interval that may be what looks like a delay of half of it.

    Args:
        late: the delay's refit.
        screened: the interval.
        fit: the base's, with the causes that were accepted before.
        segments: recordings to fit to.
    """
    space = fit.space.grown(screened.candidate)
    turning = turning_of(space)
    if turning is None:
        raise ValueError(f"{screened.candidate.label} has no interval")
    interval = 2.0 * float(late.space.values(late.z)[-1][0])
    z = turning.at(np.r_[late.z[: fit.space.size], screened.start], interval, 0.0)
    z = aligned(space, z, segments, LIKELY, fit.jacobian[:, : fit.space.size])
    cost = 0.5 * float(np.sum(space.residual([z], segments) ** 2))
    z, cost = _mended(space, z, cost, segments)
    return Rough(screened, space, z, cost / max(fit.cost, 1e-12))


def _mended(
    space: Space, z: Float64, cost: float, segments: tuple[int, ...]
) -> tuple[Float64, float]:
    """Return what one step with a derivative of its own comes to."""
    residual, jacobian = space.jacobian(z, segments, is_rough=True)
    tries = damped(space, z, residual, jacobian, list(_MENDING))
    costs = 0.5 * np.sum(space.residual(tries, segments) ** 2, axis=1)
    best = int(np.argmin(costs))
    return (tries[best], float(costs[best])) if costs[best] < cost else (z, cost)


def settle(
    space: Space, start: Float64, segments: tuple[int, ...], known: Fit | None = None
) -> Fit:
    """Return a fit from one rough derivative, mended as it goes: enough to judge, not to report.

    An exact one follows, where the rough one found much and promises more; from none, where one
    that is known foretells what comes.

    Args:
        space: what is fitted.
        start: float64[n].
        segments: recordings to fit to.
        known: a fit to them without the newest candidate.
    """
    if known is not None and turning_of(space) is None:
        down = descend(space, [space.clip(start)], known.jacobian, segments, known.space.size)
        if _is_straight(known, down):
            return down
        start = down.z
    before = _in_turn(Fit.at(space, space.clip(start), segments, is_rough=True), segments)
    found = go_down(before, segments, BOLD)
    if found.cost > before.cost * (1 - _ENOUGH) or _is_there(found):
        return found
    return go_down(Fit.at(space, found.z, segments), segments, BOLD)


def _is_straight(known: Fit, down: Fit) -> bool:
    """Return whether a derivative foretells a fit from one that lacks its newest candidate.

    Then it is about as good where that fit is, and the fit is at its best.

    Args:
        known: without the candidate, on the same rows.
        down: with it, and the derivative that led there.
    """
    is_form = down.space.candidates[-1].forms(down.space.problem.subject)
    extra = down.z[known.space.size :]
    moved = np.r_[down.z[: known.space.size] - known.z, np.where(is_form, 0.0, extra)]
    rows = len(known.residual) - known.space.size
    came = down.residual[:rows] - known.residual[:rows]
    return is_nearly(came, down.jacobian[:rows] @ moved)


def _is_there(fit: Fit) -> bool:
    """Return whether a fit's derivative, mended on the way, promises hardly anything more."""
    return promised(fit) > fit.cost * (1 - _ENOUGH)


def _in_turn(fit: Fit, segments: tuple[int, ...]) -> Fit:
    """Return a fit with the newest candidate's interval, if it has one, where it fits best."""
    turning = turning_of(fit.space)
    if turning is None:
        return fit
    others = fit.jacobian[:, : min(turning.interval, turning.phase)]
    z = aligned(fit.space, fit.z, segments, NEAR, others)
    return fit if z is fit.z else Fit.at(fit.space, z, segments, is_rough=True)
