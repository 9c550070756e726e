"""How fast an arm is at its first reading, where no velocity was logged."""

from typing import Final

import numpy as np

from shared.identification.dataset.types import Float64

WINDOW: Final = 0.1
"""From whose readings the first speed is judged (s)."""
LEAST: Final = 0.1
"""Speed from which a start is in motion (rad/s, m/s)."""
SURE: Final = 5.0
"""Standard errors that it must be from nothing to be believed."""
_FEWEST = 5
"""Readings."""
_APART = 0.5
"""Of a velocity, that two ways to tell it may differ by."""


def first_velocities(at: Float64, q: Float64) -> tuple[Float64, Float64]:
    """Return joints' velocities at the first reading and their standard errors, float64[J] each.

    They are the slopes of parabolas through the first readings; what these miss by says how sure
    they are. Of fewer than four readings nothing is sure.

    Args:
        at: float64[T], times (s).
        q: float64[T, J].
    """
    period = float(np.median(np.diff(at)))
    count = min(len(at), max(_FEWEST, round(WINDOW / period)))
    return _slopes(at[:count] - at[0], q[:count], min(2, count - 1))


def surely_moving(at: Float64, q: Float64) -> Float64:
    """Return float64[J], each joint's velocity at the first reading, 0 where it may as well rest.

    A line through the first half of the same readings must say about the same: a parabola through
    an arm that sets off in between begins by going back.
    """
    velocity, error = first_velocities(at, q)
    half = max(_FEWEST // 2 + 1, int(np.sum(at <= at[0] + 0.5 * WINDOW)))
    line, _ = _slopes(at[:half] - at[0], q[:half], 1)
    is_steady = np.abs(line - velocity) < _APART * np.abs(velocity)
    is_sure = np.abs(velocity) > np.maximum(LEAST, SURE * error)
    return np.where(is_steady & is_sure, velocity, 0.0)


def _slopes(since: Float64, q: Float64, degree: int) -> tuple[Float64, Float64]:
    """Return the slopes of polynomials at time 0 and their standard errors, float64[J] each."""
    powers = np.vander(since, degree + 1)
    inverse = np.asarray(np.linalg.pinv(powers), np.float64)
    found: Float64 = inverse @ q
    free = len(since) - degree - 1
    if free < 1:
        return found[-2], np.full_like(found[-2], np.inf)
    power: Float64 = np.mean(np.square(q - powers @ found), axis=0) * (len(since) / free)
    error: Float64 = np.sqrt(power) * float(np.linalg.norm(inverse[-2]))
    return found[-2], error
