"""Whether held-out residuals follow what a cause foretells, however little that is.

A cause is fitted to some recordings and says how others will differ from the simulation without it.
What is new in each block of noise is white (``Noise.news``), so how far the residual goes along
with that is a normal number of known variance. That tells causes of a hundredth of the noise's
power, where the loss itself, in which the noise has its square, says nothing.

What the base, or links a little other than their file, could make up for on the held-out
recordings themselves is taken out of both first: nothing that they could do is evidence.
"""

import math
from dataclasses import dataclass

import numpy as np

from shared.identification.base import loose_parameters
from shared.identification.dataset.types import Float64
from shared.identification.fit import Fit
from shared.identification.gate import STRETCH
from shared.identification.problem import BLOCK, Problem, Variant
from shared.identification.space import Space

_SURE = 2.6
"""Standard errors of what is surely foretold."""
_LEAST = 0.35
"""Of what is foretold, that has to be there."""
_RANK = 1e-6
"""Of the largest singular value: what is less changes nothing."""


@dataclass(frozen=True)
class Foretold:
    """How held-out residuals follow a cause."""

    errors: float
    """How many standard errors from not at all (1)."""
    share: float
    """Of what is foretold, that is there; 1 if the cause is right (1)."""

    @property
    def is_sure(self) -> bool:
        """Return whether they surely do, by about as much as foretold."""
        return self.errors >= _SURE and self.share >= _LEAST


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
        loose = loose_parameters(problem.subject, problem.parameters)
        base = len(problem.parameters)
        z = np.concatenate([fit.z[:base], np.zeros(len(loose)), fit.z[base:]])
        space = Space(problem.freer(loose), fit.space.candidates)
        jacobian = space.jacobian(z, self._test)[1][: -space.size][self._counts]
        basis, sizes, _ = np.linalg.svd(jacobian, full_matrices=False)
        self._basis = np.asarray(basis[:, sizes > _RANK * sizes[0]], np.float64)

    def follow(self, before: Variant, after: Variant) -> Foretold:
        """Return how residuals without a cause follow what it foretells.

        Args:
            before: without it.
            after: with it.
        """
        problem = self.fit.space.problem
        found = problem.vector([before, after], self._test)[:, self._counts]
        found = found - (found @ self._basis) @ self._basis.T
        way: Float64 = found[0] - found[1]
        left: Float64 = found[1]
        length = float(way @ way)
        if length < 1e-12:
            return Foretold(0.0, 0.0)
        along = float(way @ found[0])
        count = max(round(len(way) / self._per_stretch), 1)
        begins = np.linspace(0, len(way), count, endpoint=False).astype(np.int64)
        sums: Float64 = np.add.reduceat(way * left, begins)
        variance = max(length * max(float(np.mean(left**2)), 1.0), float(np.sum(np.square(sums))))
        return Foretold(along / math.sqrt(variance), along / length)

    @property
    def _per_stretch(self) -> float:
        problem = self.fit.space.problem
        return STRETCH / BLOCK * problem.shape_of(self._test[0])[1]


def _counted(problem: Problem, segments: tuple[int, ...]) -> np.ndarray:
    """Return bool[M]: which numbers of a residual on segments count."""
    parts: list[np.ndarray] = []
    for segment in segments:
        rows, channels = problem.shape_of(segment)
        left_out = problem.uncounted.get(segment, np.zeros(rows, np.bool_))
        parts.append(np.repeat(~left_out, channels))
    return np.concatenate(parts)
