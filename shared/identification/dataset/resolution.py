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


def step_of(q: Float64) -> float:
    """Return the step in which readings float64[T] come (rad, m); 0 where none shows.

    An encoder's readings change by whole numbers of its step, those of a fine one by anything.
    """
    changes = np.abs(np.diff(q))
    changes = changes[changes > _NOTHING]
    if len(changes) < _FEWEST:
        return 0.0
    step = float(np.median(changes[changes < 1.5 * changes.min()]))
    few = changes[changes < _FEW * step] / step
    is_whole = np.abs(few - np.round(few)) < _NEAR
    return step if len(few) >= _FEWEST and float(is_whole.mean()) >= _MOST else 0.0


def steps_of(readings: list[Float64]) -> Float64:
    """Return float64[J], the widest steps of each joint in recordings float64[T, J] (rad, m).

    Of a joint that reads the same throughout nothing is known but that its encoder will be like
    the others.
    """
    steps: Float64 = np.max([[step_of(column) for column in q.T] for q in readings], axis=0)
    is_still = np.all([np.ptp(q, axis=0) <= _NOTHING for q in readings], axis=0)
    steps[is_still] = steps.max()
    return steps
