"""Whether held-out residuals follow what a cause foretells, however little that is.

A cause is fitted to some recordings and says how others will differ from the simulation without it.
What is new in each block of noise is white (``Noise.news``), so how far the residual goes along
with that is a normal number of known variance. That tells causes of a hundredth of the noise's
power, where the loss itself, in which the noise has its square, says nothing.

What the base, or links a little other than their file, could make up for on the held-out
recordings themselves is taken out of both first: nothing that they could do is evidence.
"""

import math
from dataclasses import dataclass, field

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.parameters import loose_parameters
from shared.identification.fitting.problem import Problem, Variant
from shared.identification.fitting.space import Space
from shared.identification.gate.clusters import by_channel, by_stretch

SURELY = 5.5
"""Standard errors that a cause is off nothing by, those of the recordings that were fitted to and
of those that were held out together. Of a hundred candidates where there is none, the best come to
some 4, in one data set of fifty to 4.6 and more (ADR 0013)."""
_FOLLOWED = 1.65
"""Of those held out alone, at least (95 %)."""
_LEAST = 0.35
"""Of what is foretold, that has to be there."""
_KEPT = 0.1
"""Of the square of what a cause changes: of less nothing is told by what is left of it."""
_NEAR = 4
"""Stretches whose residuals may go together."""
_RANK = 1e-6
"""Of the largest singular value: what is less changes nothing."""


@dataclass(frozen=True)
class Foretold:
    """How held-out residuals follow a cause."""

    errors: float
    """How many standard errors from not at all (1)."""
    share: float
    """Of what is foretold, that is there; 1 if the cause is right (1)."""
    kept: float = 1.0
    """Of the square of what it changes, that neither the base nor links could make up for (1)."""
    before: Float64 = field(default_factory=lambda: np.empty(0), compare=False)
    """float64[S], mean squares of stretches without what the base could make up for."""
    after: Float64 = field(default_factory=lambda: np.empty(0), compare=False)
    """float64[S], the same with the cause."""

    @property
    def is_told(self) -> bool:
        """Return whether they could tell: base and links do not make up for nearly all of it.

        A wrong inertia of a link cannot be seen there: the links' inertia is taken out.
        """
        return self.kept >= _KEPT

    @property
    def is_refuted(self) -> bool:
        """Return whether they do not, though they could tell."""
        return self.is_told and not self.is_seen

    @property
    def is_seen(self) -> bool:
        """Return whether they could tell, and do more likely than not, by about as much."""
        return self.is_told and self.errors >= _FOLLOWED and self.share >= _LEAST


class Held:
    """Held-out recordings, without what the base could make up for there."""

    def __init__(self, fit: Fit) -> None:
        """Find what that is.

        Args:
            fit: the base's, with the causes that were accepted.
        """
        self.fit = fit
        problem = fit.space.problem
        self._test = problem.of("test")
        self._counts = _counted(problem, self._test)
        counted = (each[self._counts[each]] for each in by_stretch(problem, self._test))
        self._stretches = [each for each in counted if len(each)]
        self._channels = by_channel(problem, self._test)
        loose = loose_parameters(problem.subject, problem.parameters)
        base = len(problem.parameters)
        z = np.concatenate([fit.z[:base], np.zeros(len(loose)), fit.z[base:]])
        space = Space(problem.freer(loose), fit.space.candidates)
        jacobian = (
            space.jacobian(z, self._test, is_rough=True)[1][: -space.size] * self._counts[:, None]
        )
        basis, sizes, _ = np.linalg.svd(jacobian, full_matrices=False)
        self._basis = np.asarray(basis[:, sizes > _RANK * sizes[0]], np.float64)

    def follow(self, before: Variant, after: Variant) -> Foretold:
        """Return how residuals without a cause follow what it foretells.

        Args:
            before: without it.
            after: with it.
        """
        problem = self.fit.space.problem
        found = problem.vector([before, after], self._test) * self._counts
        whole = float(np.sum((found[0] - found[1]) ** 2))
        found = found - (found @ self._basis) @ self._basis.T
        losses = np.array([np.mean(found[:, each] ** 2, axis=1) for each in self._stretches]).T
        way: Float64 = found[0] - found[1]
        length = float(way @ way)
        if length < 1e-12:
            return Foretold(0.0, 0.0, 0.0, losses[0], losses[1])
        along = float(way @ found[0])
        left = found[1]
        white = length * max(float(left @ left) / int(self._counts.sum()), 1.0)
        of_stretches, of_channels = (
            np.array([float(way[each] @ left[each]) for each in clusters])
            for clusters in (self._stretches, self._channels)
        )
        variance = max(white, _slow(of_stretches), float(of_channels @ of_channels))
        errors = along / math.sqrt(variance)
        return Foretold(errors, along / length, length / whole, losses[0], losses[1])


def _slow(sums: Float64) -> float:
    """Return the variance of a sum of which terms near each other go together (Newey, West 1987).

    At least what it is if they do not.
    """
    alone = found = float(sums @ sums)
    for lag in range(1, _NEAR):
        found += 2.0 * (1.0 - lag / _NEAR) * float(sums[lag:] @ sums[:-lag])
    return max(alone, found)


def _counted(problem: Problem, segments: tuple[int, ...]) -> np.ndarray:
    """Return bool[M]: which numbers of a residual on segments count."""
    parts: list[np.ndarray] = []
    for segment in segments:
        rows, channels = problem.shape_of(segment)
        left_out = problem.uncounted.get(segment, np.zeros(rows, np.bool_))
        parts.append(np.repeat(~left_out, channels))
    return np.concatenate(parts)
