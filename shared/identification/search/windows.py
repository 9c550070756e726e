"""Finds when something happened that happened once.

It is first looked for in windows of half a second that cover a recording. A push that is much
shorter, or across two of them, is too weak there by as much, and the way from there to its own
window is not downhill: so windows about the best one are looked at, ever closer.
"""

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.problem import BLOCK
from shared.identification.search.looks import Look, columns_of
from shared.identification.search.screen import Screened, at_best, of_recording, shown_rows

_STEPS = (1.0, 0.5, 0.25)
"""Of the window's length, that its ends are moved by, one after another."""
_AROUND = (-1.0, -0.5, 0.0, 0.5, 1.0)
"""Steps that either end is moved by."""


def within(
    fit: Fit, candidate: Candidate, begin: float, end: float, segments: tuple[int, ...]
) -> Screened:
    """Return a candidate of one recording as it shows about a window (s).

    Args:
        fit: what is there so far, on the segments.
        candidate: what is looked for.
        begin: of the window in which it was seen.
        end: of it.
        segments: of the fit.
    """
    quantities = candidate.effect.quantities(fit.space.problem.subject, candidate.place)
    begin, end = max(begin, 0.0), min(end, quantities[1].high)
    look = _look(begin, end - begin, np.array([each.probe for each in quantities]))
    acted = of_recording(fit, candidate.recording, segments)
    columns = columns_of(fit, {candidate: [look]}, segments, acted)
    (found,) = at_best(fit, columns, shown_rows(fit, segments))
    return closer(fit, found.screened, segments)


def closer(fit: Fit, screened: Screened, segments: tuple[int, ...]) -> Screened:
    """Return a candidate of one recording in the window in which it explains most.

    Args:
        fit: what is there so far, on the segments.
        screened: the candidate; its numbers are how much, when it begins and how long it lasts.
        segments: of the fit.
    """
    candidate, subject = screened.candidate, fit.space.problem.subject
    quantities = candidate.effect.quantities(subject, candidate.place)
    probes = np.array([each.probe for each in quantities])
    until = quantities[1].high
    rows, acted = shown_rows(fit, segments), of_recording(fit, candidate.recording, segments)
    best = screened
    for step in _STEPS:
        _, begin, length = best.start * probes
        ends = np.clip(begin + step * length * np.array(_AROUND), 0.0, until)
        others = np.clip(begin + length * (1.0 + step * np.array(_AROUND)), 0.0, until)
        windows = {
            (float(first), float(last))
            for first in ends
            for last in others
            if last - first >= BLOCK
        }
        looks = [_look(first, last - first, probes) for first, last in sorted(windows)]
        columns = columns_of(fit, {candidate: looks}, segments, acted)
        (found,) = at_best(fit, columns, rows)
        best = max(best, found.screened, key=lambda one: one.share)
    return best


def _look(begin: float, length: float, probes: Float64) -> Look:
    """Return a look at a window (s): the size is one probe there."""
    form = np.array([0.0, begin, length]) / probes
    return Look(1.0, form, (0,), (np.array([probes[0], begin, length]),))
