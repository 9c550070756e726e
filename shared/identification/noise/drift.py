"""How an arm that nothing holds goes astray after the start of a part.

Replayed under torques from a measured state it is off by what that state was off, and by what
pushes it at random, twice integrated: nothing at first, a hundred times as much 0.3 s later. As
they are, residuals say what the last blocks of a part say. What is new in each block, beside what
the blocks before it foretell, weighs all of them by how much they know (generalised least squares,
Aitken 1936; of a state that a white force moves, a Kalman filter's innovations).

Only where repeats measure it. Commands of a controller that is not in the model answer what pushes
the arm, so what is compared there is what each recording is off by under its own (``answered.py``).
"""

# pyright: basic
# (scipy's types are partial)

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from shared.identification.dataset.types import Float64

_FEWEST = 8
"""Parts that it takes to say how noise grows."""
_LOUD = 2.0
"""Times the usual power, from which a part has no more of a say than that."""
_LEAST = 1e-8
"""Of the largest variance, that each kind has at least."""
_MOST = 100.0
"""The same, at most."""
_ROUNDS = 3
_SLOWING = (0.0, 0.01, 0.02, 0.04, 0.08, 0.16, 0.32)
"""Shares of its speed that a joint may lose in a block."""
_FINE = 4
"""Instants of a block at which a push may begin."""
_LASTING = (1.5, 5.0, 100.0)
"""For how long pushes last that are not white: some blocks, and more than a part."""


@dataclass(frozen=True)
class Drift:
    """Variances of the kinds of noise, by channel, in noise floors."""

    kinds: Float64
    """float64[C, K]: of each block by itself, of where a part begins, of how fast (a block), of the
    change of speed within a block by white pushes, and by such as last for ``_LASTING``."""
    slowing: Float64
    """float64[C], share of its speed that a joint loses in a block by itself."""
    _whiten: dict[int, Float64] = field(default_factory=dict[int, Float64], repr=False)

    def news(self, residuals: Float64) -> Float64:
        """Return what is new in each block: float64[B, C], of variance 1 where all is noise.

        Args:
            residuals: float64[B, C], in noise floors, of one part from its first block on.
        """
        return np.einsum("cab,bc->ac", self._whitening(len(residuals)), residuals)

    def spread(self, blocks: int) -> Float64:
        """Return float64[blocks, C], standard deviations block by block, in noise floors."""
        return np.sqrt(np.stack([each.diagonal() for each in self._covariances(blocks)], axis=1))

    def scaled(self, by: Float64) -> "Drift":
        """Return the same in noise floors that are larger by factors float64[C]."""
        return Drift(self.kinds / by[:, None] ** 2, self.slowing)

    def begun_as(self, position: Float64, speed: Float64) -> "Drift":
        """Return the same of parts whose first states are off by so much at least.

        Args:
            position: float64[C], standard deviations, in noise floors.
            speed: float64[C], the same of speeds (1 / block).
        """
        kinds = self.kinds.copy()
        kinds[:, 1] = np.maximum(kinds[:, 1], position**2)
        kinds[:, 2] = np.maximum(kinds[:, 2], speed**2)
        return Drift(kinds, self.slowing)

    def of_pushes(self) -> "Drift":
        """Return the same of parts whose first states are known."""
        kinds = self.kinds.copy()
        kinds[:, 1:3] = 0.0
        return Drift(kinds, self.slowing)

    def beside(self, other: "Drift") -> "Drift":
        """Return that of these channels, then of others."""
        kinds = np.concatenate([self.kinds, other.kinds])
        return Drift(kinds, np.r_[self.slowing, other.slowing])

    def _whitening(self, blocks: int) -> Float64:
        """Return float64[C, blocks, blocks], lower triangles."""
        if blocks not in self._whiten:
            self._whiten[blocks] = np.stack(
                [_whitening(each) for each in self._covariances(blocks)]
            )
        return self._whiten[blocks]

    def _covariances(self, blocks: int) -> list[Float64]:
        """Return float64[blocks, blocks] of each channel."""
        both = zip(self.kinds, self.slowing, strict=True)
        return [_covariance(kinds, _kernels(blocks, float(slowing))) for kinds, slowing in both]


def drift_of(parts: Sequence[Float64], scale: float, rounding: Float64) -> Drift | None:
    """Return how noise grows, by maximum likelihood; None if there are too few parts.

    A part in which something happened has no more of a say than twice a usual one.

    Args:
        parts: float64[B, C] each, from the beginning of a part; those of the usual length count.
        scale: of what they are, to be noise in noise floors.
        rounding: float64[C], what the steps of a reading hide, in noise floors.
    """
    lengths = [len(each) for each in parts]
    usual = max(set(lengths), key=lengths.count, default=0)
    whole = [each for each in parts if len(each) == usual]
    if len(whole) < _FEWEST or usual < _FEWEST:
        return None
    values = scale * np.stack(whole)
    found = [_likeliest(values[..., channel], least) for channel, least in enumerate(rounding**2)]
    return Drift(
        np.stack([each.kinds for each in found]), np.array([each.slowing for each in found])
    )


class _Likely(NamedTuple):
    """What explains a channel's noise."""

    unlikely: float
    slowing: float
    kinds: Float64


def _likeliest(values: Float64, least: float) -> _Likely:
    """Return what explains float64[P, B] best."""
    return min(
        (_with_slowing(values, least, each) for each in _SLOWING), key=lambda one: one.unlikely
    )


def _with_slowing(values: Float64, least: float, slowing: float) -> _Likely:
    """Return the variances that explain float64[P, B] best, for one slowing."""
    kernels = _kernels(values.shape[1], slowing)
    weights = np.ones(len(values))
    size = float(np.mean(values**2)) + 1e-30
    sizes = size / kernels.diagonal(axis1=1, axis2=2).mean(axis=1)
    low, high = _LEAST * sizes, _MOST * sizes
    low[0] = min(max(low[0], least), high[0])
    x, unlikely = np.log(np.clip(0.25 * sizes, low, high)), np.inf
    for _ in range(_ROUNDS):
        moment = np.einsum("p,pa,pb->ab", weights, values, values) / weights.sum()
        bounds = list(zip(np.log(low), np.log(high), strict=True))
        found = minimize(
            _unlikely, x, (moment, kernels), jac=True, method="L-BFGS-B", bounds=bounds
        )
        x, unlikely = found.x, float(found.fun)
        news = values @ _whitening(_covariance(np.exp(x), kernels)).T
        power = np.mean(news**2, axis=1)
        weights = np.minimum(1.0, _LOUD * np.median(power) / np.maximum(power, 1e-30))
    return _Likely(unlikely, slowing, np.exp(x))


def _unlikely(x: Float64, moment: Float64, kernels: Float64) -> tuple[float, Float64]:
    """Return twice the negative log likelihood of a second moment, and its derivative."""
    covariance = _covariance(np.exp(x), kernels)
    inverse = np.linalg.inv(covariance)
    value = float(np.linalg.slogdet(covariance)[1] + np.sum(inverse * moment))
    slope = inverse - inverse @ moment @ inverse
    return value, np.exp(x) * np.einsum("ab,kab->k", slope, kernels)


def _covariance(kinds: Float64, kernels: Float64) -> Float64:
    """Return float64[B, B]."""
    return np.einsum("k,kab->ab", kinds, kernels)


def _whitening(covariance: Float64) -> Float64:
    """Return float64[B, B], the lower triangle that makes such noise white."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)), np.float64)


@cache
def _kernels(blocks: int, slowing: float) -> Float64:
    """Return float64[K, blocks, blocks], covariances of each kind with variance 1."""
    at: Float64 = np.arange(blocks, dtype=np.float64) + 0.5
    fine: Float64 = (np.arange(_FINE * blocks, dtype=np.float64) + 0.5) / _FINE
    reaches = _way(np.maximum(at[:, None] - fine, 0.0), slowing) / _FINE
    lags = np.abs(np.subtract.outer(fine, fine))
    pushes = [np.exp(-lags / each) for each in _LASTING]
    pushed = [reaches @ each @ reaches.T for each in (_FINE * np.eye(len(fine)), *pushes)]
    begun = _way(at, slowing)
    return np.stack([np.eye(blocks), np.ones((blocks, blocks)), np.outer(begun, begun), *pushed])


def _way(at: Float64, slowing: float) -> Float64:
    """Return how far something of speed 1 gets that slows down by a share of its speed a block."""
    return at if slowing == 0.0 else -np.expm1(-slowing * at) / slowing
