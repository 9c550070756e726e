"""How large noise is, told from where there is least of it.

A stretch in which repeats part company (contact, a singular posture) would hide everything, so
levels are taken from stretches of 0.5 s without their noisiest fifth, and so are correlations:
what parts slowly correlates like nothing else.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from shared.identification.dataset.types import Float64

OF_PAIR = np.sqrt(0.5)
"""Of what two recordings differ by, that is the noise of one."""
_STRETCH = 25
"""Blocks whose power is looked at together."""
_SAMPLES = 200
"""Of simulated noise, to learn what leaving out the noisiest stretches takes off."""


def level_of(parts: Sequence[Float64], scale: float) -> tuple[Float64, Float64]:
    """Return standard deviations and neighbours' correlations, by column.

    Args:
        parts: float64[B, D] each, rows that follow each other.
        scale: of what they are, to be noise.
    """
    stretches = [
        part[begin : begin + _STRETCH]
        for part in parts
        for begin in range(0, max(len(part) - _STRETCH + 1, 1), _STRETCH)
    ]
    power = np.array([np.mean(stretch**2, axis=0) for stretch in stretches])
    pairs = [np.stack([stretch[1:], stretch[:-1]]) for stretch in stretches]
    moved = np.array([np.prod(pair, axis=0).mean(axis=0) for pair in pairs])
    total = np.array([np.mean(pair**2, axis=(0, 1)) for pair in pairs])
    shared = _quieter(moved, power) / np.maximum(_quieter(total, power), 1e-30)
    correlation = np.clip(shared, 0.0, 0.99)
    variance = _quieter(power, power) / _lost(float(correlation.mean()), len(power))
    return scale * np.sqrt(np.maximum(variance, 1e-16)), correlation


def _quieter(values: Float64, power: Float64) -> Float64:
    """Return the mean over stretches without the noisiest fifth: float64[D] of float64[S, D]."""
    count = max(int(np.ceil(0.8 * len(power))), 1)
    kept = np.argsort(power, axis=0, kind="stable")[:count]
    return np.take_along_axis(values, kept, axis=0).mean(axis=0)


@cache
def _lost(correlation: float, stretches: int) -> float:
    """Return which share of the power that leaves of noise that is the same everywhere."""
    rng = np.random.default_rng(0)
    noise = np.empty((_STRETCH, stretches, _SAMPLES))
    noise[0] = rng.standard_normal((stretches, _SAMPLES))
    for index in range(1, _STRETCH):
        fresh = rng.standard_normal((stretches, _SAMPLES))
        noise[index] = correlation * noise[index - 1] + np.sqrt(1 - correlation**2) * fresh
    power = np.mean(noise**2, axis=0)
    return float(_quieter(power, power).mean())
