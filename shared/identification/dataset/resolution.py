"""In which steps an encoder reads."""

import numpy as np

from shared.identification.dataset.types import Float64

_NOTHING = 1e-9
"""Change that is arithmetic (rad, m)."""
_FEWEST = 8
"""Changes of a few steps, to believe in them."""
_FEW = 4.5
"""Steps."""
_NEAR = 0.2
"""Steps, that a change may be off a whole number of them for having been rounded after."""
_MOST = 0.95
"""Share of the changes of a few steps that have to be whole numbers of them."""
_SAME = 1e-3
"""Steps, that two changes by one step may differ by for being told in other words."""
_ROUNDED = 3
"""Lengths of one step, at most, where readings were rounded after."""


def step_of(q: Float64) -> float:
    """Return the step in which readings float64[T] come (rad, m); 0 where none shows.

    An encoder's readings change by whole numbers of its step, those of a fine one by anything: at
    an even speed by nearly the same each time, though not by quite the same, nor ever by twice it.
    """
    changes = np.abs(np.diff(q))
    is_even = bool((changes > _NOTHING).all())
    changes = changes[changes > _NOTHING]
    if len(changes) < _FEWEST:
        return 0.0
    step = float(np.median(changes[changes < 1.5 * changes.min()]))
    few = changes[changes < _FEW * step] / step
    if len(few) < _FEWEST or (is_even and few.max() < 1.5):
        return 0.0
    is_whole = np.abs(few - np.round(few)) < _NEAR
    ones = np.sort(few[np.round(few) == 1.0])
    lengths = 1 + np.count_nonzero(np.diff(ones) > _SAME)
    return step if float(is_whole.mean()) >= _MOST and lengths <= _ROUNDED else 0.0


def steps_of(readings: list[Float64]) -> Float64:
    """Return float64[J], the widest steps of each joint in recordings float64[T, J] (rad, m).

    Of a joint that reads the same throughout nothing is known but that its encoder will be like
    the others.
    """
    steps: Float64 = np.max([[step_of(column) for column in q.T] for q in readings], axis=0)
    is_still = np.all([np.ptp(q, axis=0) <= _NOTHING for q in readings], axis=0)
    steps[is_still] = steps.max()
    return steps
