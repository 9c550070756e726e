"""Motions that show things: postures to hold, crawling, sines, swings and a chirp, all from rest.

Each returns postures relative to the home posture as shares of the joints' reach, float64[C, J],
and ends where it began. Which shows what: identification.md of the project's facts, c5.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from shared.identification.dataset.types import Float64

PERIOD: Final = 0.01
"""Between commands (s)."""
_LEAD: Final = 0.5
"""Motion grows from nothing and goes back to it within this long (s)."""
_CREPT: Final = 0.05
"""Furthest that a crawl goes to either side (rad, m)."""
DITHER: Final = 0.008
"""Of a held posture (rad, m): turns friction round without moving the arm."""
_DITHER_FREQUENCY: Final = 1.5
"""(Hz)."""

Duration = Callable[[Float64, Float64], float]
"""Returns how long the way from one posture to another has to take (s)."""


def instants(seconds: float) -> Float64:
    """Return float64[C], when commands are given (s)."""
    return PERIOD * np.arange(max(round(seconds / PERIOD), 2), dtype=np.float64)


def sines(seconds: float, reach: Float64, rng: np.random.Generator) -> Float64:
    """Return four sines a joint, 0.1 to 1 Hz, of even speed."""
    at, joints = instants(seconds), len(reach)
    low, high = max(0.1, 1.0 / seconds), 1.0
    frequency = np.exp(rng.uniform(np.log(low), np.log(high), (joints, 4)))
    phase = rng.uniform(0.0, 2.0 * np.pi, (joints, 4))
    weight = rng.uniform(0.5, 1.0, (joints, 4)) / frequency
    waves = np.sin(2.0 * np.pi * frequency * at[:, None, None] + phase)
    out = np.einsum("tjk,jk->tj", waves, weight)
    return _faded(at, reach * out / np.abs(out).max(axis=0))


def crawl(seconds: float, speed: float, reach: Float64, rng: np.random.Generator) -> Float64:
    """Return joints that creep back and forth, each in its own time.

    Args:
        seconds: how long.
        speed: of the slower half of the time (rad/s, m/s); the other half goes four times as fast.
        reach: float64[J].
        rng: what is drawn from.
    """
    at = instants(seconds)
    pace = 2.5 + 1.5 * np.tanh((at - 0.5 * at[-1]) / 0.3)
    gone = np.cumsum(pace) * PERIOD
    swept = np.minimum(_CREPT, reach) * rng.uniform(0.4, 1.0, len(reach))  # to each side
    cycle = 2.0 * np.pi * gone[:, None] * speed / (4.0 * swept)
    out = swept * _rounded(cycle + rng.uniform(0.0, 2.0 * np.pi, len(reach)))
    return _faded(at, out)


def chirp(seconds: float, highest: float, reach: Float64, rng: np.random.Generator) -> Float64:
    """Return small oscillation from 0.5 Hz up, of even acceleration above 1.5 Hz.

    Args:
        seconds: how long.
        highest: frequency (Hz).
        reach: float64[J].
        rng: what is drawn from.
    """
    at = instants(seconds)
    frequency = 0.5 * (highest / 0.5) ** (at / at[-1])
    phase = 2.0 * np.pi * np.cumsum(frequency) * PERIOD
    size = np.minimum(1.0, (1.5 / frequency) ** 2)[:, None]
    shift = rng.uniform(0.0, 2.0 * np.pi, len(reach))
    return _faded(at, 0.15 * reach * size * np.sin(phase[:, None] + shift))


def visits(
    postures: Float64, dwell: Float64, duration: Duration, dither: float, rng: np.random.Generator
) -> Float64:
    """Return ways from posture to posture and back home, each held for a while.

    Args:
        postures: float64[V, J], relative to home (rad, m).
        dwell: float64[V + 1], how long each is held, home at last (s).
        duration: of a way.
        dither: how far held postures tremble to either side (rad, m).
        rng: what is drawn from.
    """
    joints = int(postures.shape[1])
    shift: Float64 = rng.uniform(0.0, 2.0 * np.pi, size=(joints,))
    here: Float64 = np.zeros(joints)
    parts = [np.zeros((20, joints))]
    for there, held in zip([*postures, np.zeros(joints)], dwell, strict=True):
        parts.append(here + minimum_jerk(duration(here, there))[:, None] * (there - here))
        rest = instants(held)
        trembling = dither * np.sin(2.0 * np.pi * _DITHER_FREQUENCY * rest[:, None] + shift)
        parts.append(there + _faded(rest, trembling))
        here = there
    return np.concatenate(parts)


def minimum_jerk(seconds: float) -> Float64:
    """Return float64[C], from 0 to 1 without a jolt (Flash and Hogan 1985)."""
    share = np.linspace(0.0, 1.0, max(int(np.ceil(seconds / PERIOD)), 2) + 1)[1:]
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def spread(count: int, reach: Float64, rng: np.random.Generator) -> Float64:
    """Return float64[count, J]: postures of which each joint takes every level once.

    A Latin hypercube: gravity, offsets and springs are told apart by joints that move on their own.
    """
    levels = (np.arange(count) + 0.5) / count * 2.0 - 1.0
    return np.stack([rng.permutation(levels) for _ in reach], axis=1) * reach


def far(count: int, reach: Float64, rng: np.random.Generator) -> Float64:
    """Return float64[count, J]: postures at the ends of the reach, each on the other side."""
    sides = rng.choice([-1.0, 1.0], len(reach))
    turned = np.where(np.arange(count)[:, None] % 2, sides, -sides)
    flips = np.where(rng.random((count, len(reach))) < 0.25, -1.0, 1.0)
    return turned * flips * rng.uniform(0.6, 1.0, (count, len(reach))) * reach


def _rounded(phase: Float64) -> Float64:
    """Return a triangle wave of an angle whose corners are round, -1 to 1."""
    return np.arcsin(0.97 * np.sin(phase)) / np.arcsin(0.97)


def _faded(at: Float64, out: Float64) -> Float64:
    """Return a motion that begins and ends at rest at 0."""
    lead = min(_LEAD, at[-1] / 4.0)
    share = np.clip(np.minimum(at, at[-1] - at) / lead, 0.0, 1.0)
    return (share**3 * (10.0 - 15.0 * share + 6.0 * share**2))[:, None] * out
