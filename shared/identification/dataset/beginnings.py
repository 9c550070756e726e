"""Where an arm is at its first reading, and how fast."""

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
_FITS = 1.5
"""Mean square, in noises, up to which a cubic fits readings."""
_THERE = 3.0
"""Standard errors from which a logged velocity is not noise."""
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


def logged_velocities(at: Float64, q: Float64, qd: Float64) -> Float64:
    """Return joints' velocities at the first reading where velocities were logged, float64[J].

    One reading has all of its noise, as if an arm at rest set off by it. So they are those of
    cubics through the first positions and velocities together, each by its noise, or 0 where they
    may as well be; and the first reading where no cubic fits those after it, however few.

    Args:
        at: float64[T], times (s).
        q: float64[T, J].
        qd: float64[T, J].
    """
    noises = _noise(q), _noise(qd)
    joints = zip(q.T, qd.T, *noises, strict=True)
    return np.array([_logged(at - at[0], *each) for each in joints], np.float64)


def first_positions(at: Float64, q: Float64, velocity: Float64) -> Float64:
    """Return where joints are at the first reading, float64[J].

    Of those at rest that is the mean of as many of the first readings as are the same but for
    noise: a single one is off by all of it, and a servo takes its time to take that back.

    Args:
        at: float64[T], times (s).
        q: float64[T, J].
        velocity: float64[J], at the first reading.
    """
    found = q[0].copy()
    for joint, noise in enumerate(_noise(q)):
        count = int(np.sum(at - at[0] <= WINDOW))
        while velocity[joint] == 0.0 and count >= _FEWEST:
            first = q[:count, joint]
            if float(np.var(first)) < _FITS * float(noise) ** 2:
                found[joint] = first.mean()
                break
            count //= 2
    return found


def _noise(readings: Float64) -> Float64:
    """Return the standard deviation of each column's noise by differences of four readings.

    What is smooth takes no part in these, so that it is rather said too large than too small.
    """
    if len(readings) < _FEWEST:
        return np.zeros_like(readings[0])
    third: Float64 = np.diff(readings, 3, axis=0)
    return np.sqrt(np.mean(np.square(third), axis=0) / 20.0)


def _logged(since: Float64, q: Float64, qd: Float64, of_q: float, of_qd: float) -> float:
    """Return one joint's; noises are those of its positions and of its velocities."""
    count = int(np.sum(since <= WINDOW)) if of_q > 0.0 and of_qd > 0.0 else 0
    while count >= _FEWEST:
        at = since[:count]
        still, one = np.zeros(count), np.ones(count)
        powers = np.r_[
            np.stack([one, at, at**2, at**3], axis=1) / of_q,
            np.stack([still, one, 2.0 * at, 3.0 * at**2], axis=1) / of_qd,
        ]
        wanted = np.r_[q[:count] / of_q, qd[:count] / of_qd]
        inverse = np.asarray(np.linalg.pinv(powers), np.float64)
        found = inverse @ wanted
        left = wanted - powers @ found
        if float(left @ left) < _FITS * (len(left) - 4):
            return _there(float(found[1]), float(np.linalg.norm(inverse[1])))
        count //= 2
    return _there(float(qd[0]), of_qd)


def _there(velocity: float, error: float) -> float:
    """Return a velocity, or 0 if it may as well be its error."""
    return velocity if abs(velocity) > _THERE * error else 0.0


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
