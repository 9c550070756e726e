"""Finds stretches in which residuals are far over their noise, however short or slow.

Two statistics are scanned over all windows of several lengths. The power of the innovations of a
first-order autoregression sees what is fast; the mean sees what is slow, which innovations hide (a
tracker that slipped by six noise floors raised their power by 12 %). The limit of each keeps false
alarms of all windows together below ``ALARM`` (Bonferroni). Where recordings repeat each other
their differences say by how much the noise is wider than the autoregression has it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.noise.memory import Memory

POWER_WINDOWS = (5, 10, 25)
"""Blocks."""
MEAN_WINDOWS = (5, 25, 100, 250)
"""Blocks."""
ALARM = 0.01
"""Probability that noise alone shows anything."""
SLACK = 1.15
"""Noise may be so many times what it was measured to be."""
UNMEASURED = 1.5
"""The same without repeats, which show only what is faster than the arm."""
_STRETCH = 25
"""Blocks in which a correlation is looked at together."""
_QUIET = 0.4
"""Share of repeats that noise is learned from, the quietest: a push in one of two is none."""
_FEWEST = 8
"""Independent windows from which repeats say how wide a statistic is."""
_GAINS = (2.0, 4.0, 16.0, 64.0, 256.0, 4096.0)
"""Powers that a stretch is tried with, in noise floors."""
_LEAST_GAIN = 18.0
"""Log likelihood ratio of a stretch: one in 10^8 windows of noise."""


@dataclass(frozen=True)
class Width:
    """How wide statistics of noise are."""

    correlation: Float64
    """float64[C], of neighbouring blocks."""
    power: Float64
    """float64[W, C], by window: so many times the power of an autoregression."""
    mean: Float64
    """float64[W, C], so many times its standard deviation."""


def width_of(noise: Sequence[Float64], correlation: Float64, is_measured: bool) -> Width:
    """Return how wide noise is.

    Args:
        noise: float64[B, C] each, in noise floors; differences of repeats over root 2.
        correlation: float64[C], where ``noise`` is too short to say.
        is_measured: whether there were repeats.
    """
    correlation = _correlation(noise, correlation)
    slack = SLACK if is_measured else UNMEASURED
    power = np.full((len(POWER_WINDOWS), len(correlation)), slack**2)
    mean = np.full((len(MEAN_WINDOWS), len(correlation)), slack)
    usual = NormalDist().inv_cdf(0.5 + 0.5 * _QUIET)
    for row, window in enumerate(POWER_WINDOWS):
        if found := _usable(noise, window):
            seen = np.concatenate([_power(each, correlation, window) for each in found])
            seen = np.quantile(seen, _QUIET, axis=0) / _chi_square(1.0 - _QUIET, window)
            power[row] *= np.maximum(seen, 1.0)
        elif row:
            power[row] = power[row - 1]
    for row, window in enumerate(MEAN_WINDOWS):
        if found := _usable(noise, window):
            seen = np.concatenate([np.abs(_mean(each, correlation, window)) for each in found])
            mean[row] *= np.maximum(np.quantile(seen, _QUIET, axis=0) / usual, 1.0)
        elif row:
            mean[row] = mean[row - 1]
    return Width(correlation, power, mean)


def scan(parts: Sequence[Float64], width: Width) -> list[np.ndarray]:
    """Return bool[B, C] for each part: blocks in a window that noise does not fill.

    Args:
        parts: float64[B, C] each, in noise floors.
        width: of the noise.
    """
    blocks = sum(len(part) for part in parts)
    channels = len(width.correlation)
    tests = sum(4.0 * blocks * channels / window for window in (*POWER_WINDOWS, *MEAN_WINDOWS))
    chance = ALARM / max(tests, 1.0)
    high = NormalDist().inv_cdf(1.0 - 0.5 * chance)
    out: list[np.ndarray] = []
    for part in parts:
        hot = np.zeros(part.shape, np.bool_)
        for row, window in enumerate(POWER_WINDOWS):
            if len(part) >= window:
                limit = _chi_square(chance, window) * width.power[row]
                _mark(hot, _power(part, width.correlation, window) > limit, window)
        for row, window in enumerate(MEAN_WINDOWS):
            if len(part) >= window:
                seen = np.abs(_mean(part, width.correlation, window))
                _mark(hot, seen > high * width.mean[row], window)
        out.append(hot)
    return out


def stretches(x: Float64, hot: np.ndarray, width: float, correlation: float) -> list[slice]:
    """Return what is off within hot blocks of one channel, by change points.

    A stretch is the interval of the largest likelihood ratio of a higher power inside it
    (a maximal sum of consecutive numbers), then the same on what is left of either side.

    Args:
        x: float64[B], in noise floors.
        hot: bool[B], from :func:`scan`.
        width: standard deviation of the noise (1).
        correlation: of neighbouring blocks, for which a ratio counts less.
    """
    edges = np.flatnonzero(np.diff(np.r_[False, hot, False].astype(np.int8)))
    weight = (1.0 - correlation**2) / (1.0 + correlation**2)
    power = (x / width) ** 2
    found: list[slice] = []
    left = [(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]
    while left:
        begin, end = left.pop()
        gain, first, last = max(
            (_best(weight * 0.5 * (power[begin:end] * (1.0 - 1.0 / each) - np.log(each))))
            for each in _GAINS
        )
        if gain < _LEAST_GAIN:
            continue
        found.append(slice(begin + first, begin + last))
        left += [(begin, begin + first), (begin + last, end)]
    return sorted(found, key=lambda each: int(each.start))


def merged(pieces: Sequence[slice], gap: int) -> list[slice]:
    """Return pieces without gaps of at most so many blocks between them."""
    out: list[slice] = []
    for piece in sorted(pieces, key=lambda each: int(each.start)):
        if out and piece.start - out[-1].stop <= gap:
            out[-1] = slice(out[-1].start, max(out[-1].stop, piece.stop))
        else:
            out.append(piece)
    return out


def _best(scores: Float64) -> tuple[float, int, int]:
    """Return the largest sum of consecutive scores, and of which (Kadane)."""
    total = np.r_[0.0, np.cumsum(scores)]
    lowest = np.minimum.accumulate(total)
    end = int(np.argmax(total - lowest))
    begin = int(np.argmin(total[: end + 1]))
    return float(total[end] - total[begin]), begin, end


def _correlation(noise: Sequence[Float64], otherwise: Float64) -> Float64:
    """Return float64[C], of neighbouring blocks in the quietest stretches."""
    found = _usable(noise, _STRETCH)
    if not found:
        return otherwise
    pieces = np.stack(
        [
            each[begin : begin + _STRETCH]
            for each in found
            for begin in range(0, len(each) - _STRETCH + 1, _STRETCH)
        ]
    )
    power = np.sum(pieces**2, axis=1)
    along = np.sum(pieces[:, 1:] * pieces[:, :-1], axis=1)
    order = np.argsort(power, axis=0)[: max(round(_QUIET * len(pieces)), 1)]
    kept = np.take_along_axis(along, order, 0).sum(axis=0)
    return np.clip(kept / np.take_along_axis(power, order, 0).sum(axis=0), 0.0, 0.99)


def _usable(noise: Sequence[Float64], window: int) -> list[Float64]:
    found = [each for each in noise if len(each) >= window]
    return found if sum(len(each) // window for each in found) >= _FEWEST else []


def _power(x: Float64, correlation: Float64, window: int) -> Float64:
    """Return float64[B - window + 1, C], mean squares of innovations."""
    memory = Memory(correlation, np.sqrt(1.0 - correlation**2))
    return _moving(memory.news(x) ** 2, window)


def _mean(x: Float64, correlation: Float64, window: int) -> Float64:
    """Return float64[B - window + 1, C], means in standard deviations of an autoregression's."""
    apart = np.arange(1, window)[:, None]
    variance = (1.0 + 2.0 * np.sum((1.0 - apart / window) * correlation**apart, axis=0)) / window
    return _moving(x, window) / np.sqrt(variance)


def _moving(x: Float64, window: int) -> Float64:
    total = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(x, axis=0)])
    return (total[window:] - total[:-window]) / window


def _mark(hot: np.ndarray, is_high: np.ndarray, window: int) -> None:
    """Mark all blocks of the windows that are high."""
    count = np.zeros((len(hot) + 1, hot.shape[1]), np.int64)
    count[: len(is_high)] += is_high
    count[window : window + len(is_high)] -= is_high
    hot |= np.cumsum(count, axis=0)[:-1] > 0


def _chi_square(chance: float, freedom: int) -> float:
    """Return what the mean of so many squares exceeds by chance (Wilson and Hilferty 1931)."""
    spread = 2.0 / (9.0 * freedom)
    return (1.0 - spread + NormalDist().inv_cdf(1.0 - chance) * spread**0.5) ** 3
