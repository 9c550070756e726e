"""A vector for the optimiser: the base's coordinates, then the sizes of effects in probes."""

from dataclasses import dataclass

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate, Quantity
from shared.identification.fitting.problem import Problem, Variant

_STEP = 1e-3
"""Of a difference quotient along a base coordinate.

Of an arm under servos whose efforts nobody logs all masses, gains, frictions and loads may be
larger together, and only what is known of links says by how much. A quotient over 2 % bends that
so much that recordings seem to show it: sizes are biased, and intervals a tenth of what they
should be."""
_EXTRA_STEP = 0.01
"""Along the size of an effect, in probes."""
_OF_TURN = 0.05
"""Along an interval that comes again and again: of itself, what its last turn moves by."""


@dataclass(frozen=True)
class Space:
    """Where a fit looks."""

    problem: Problem
    candidates: tuple[Candidate, ...] = ()

    @property
    def base_size(self) -> int:
        """Return how many numbers are the base's."""
        return len(self.problem.parameters)

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Return the effects' numbers, in order."""
        subject = self.problem.subject
        return tuple(
            quantity
            for candidate in self.candidates
            for quantity in candidate.effect.quantities(subject, candidate.place)
        )

    @property
    def size(self) -> int:
        """Return the length of the vector."""
        return self.base_size + len(self.quantities)

    @property
    def bounds(self) -> tuple[Float64, Float64]:
        """Return the lowest and the highest vector."""
        base, extra = self.problem.parameters, self.quantities
        low = [each.low for each in base] + [each.low / each.probe for each in extra]
        high = [each.high for each in base] + [each.high / each.probe for each in extra]
        return np.array(low), np.array(high)

    @property
    def priors(self) -> Float64:
        """Return float64[n], standard deviations of what is known beforehand; inf of effects."""
        base = [each.prior for each in self.problem.parameters]
        return np.array(base + [np.inf] * len(self.quantities))

    @property
    def details(self) -> Float64:
        """Return float64[n], where nothing is there and details of what might be are as looked."""
        extra = [each.grid[0] / each.probe if each.is_detail else 0.0 for each in self.quantities]
        return np.r_[np.zeros(self.base_size), extra]

    @property
    def steps(self) -> Float64:
        """Return float64[n], of difference quotients."""
        return np.array([_STEP] * self.base_size + [_EXTRA_STEP] * len(self.quantities))

    def smooth(self) -> "Space":
        """Return the same with smooth commands, see :meth:`Problem.smooth`."""
        return Space(self.problem.smooth(), self.candidates)

    def variant(self, z: Float64) -> Variant:
        """Return the model at a vector."""
        extras: list[tuple[Candidate, Float64]] = []
        begin = self.base_size
        for candidate in self.candidates:
            quantities = candidate.effect.quantities(self.problem.subject, candidate.place)
            end = begin + len(quantities)
            probes = np.array([each.probe for each in quantities])
            extras.append((candidate, z[begin:end] * probes))
            begin = end
        return Variant(z[: self.base_size], tuple(extras))

    def values(self, z: Float64) -> tuple[Float64, ...]:
        """Return each effect's numbers in their own units."""
        return tuple(values for _, values in self.variant(z).extras)

    def where(self, candidate: Candidate) -> slice:
        """Return which of the vector's numbers are an effect's."""
        begin = self.base_size
        for each in self.candidates:
            end = begin + len(each.effect.quantities(self.problem.subject, each.place))
            if each == candidate:
                return slice(begin, end)
            begin = end
        raise ValueError(f"{candidate.label} is not fitted")

    def clip(self, z: Float64) -> Float64:
        """Return the vector within bounds."""
        return np.clip(z, *self.bounds)

    def grown(self, candidate: Candidate) -> "Space":
        """Return it with one more effect."""
        return Space(self.problem, (*self.candidates, candidate))

    def residual(
        self, zs: list[Float64], segments: tuple[int, ...], timestep: float | None = None
    ) -> Float64:
        """Return float64[V, M + n]: whitened residuals, and what speaks against leaving nominal.

        Args:
            zs: where.
            segments: of which recordings.
            timestep: of the physics (s); the arm's own if None.
        """
        found = self.problem.vector([self.variant(z) for z in zs], segments, timestep)
        prior = np.stack([z / self.priors for z in zs])
        return np.concatenate([found, prior], axis=1)

    @property
    def has_rough(self) -> bool:
        """Return whether a derivative may be a rough one, which costs half as much."""
        return self.problem.rough_timestep is not None

    def jacobian(
        self, z: Float64, segments: tuple[int, ...], only: range | None = None,
        is_rough: bool = False,
    ) -> tuple[Float64, Float64]:  # fmt: skip
        """Return the residual float64[M + n] at a vector and its derivative float64[M + n, k].

        Args:
            z: where.
            segments: of which recordings.
            only: columns that are wanted; all if None.
            is_rough: whether the derivative may be off by a few percent; the residual never is.
        """
        columns = range(self.size) if only is None else only
        steps = self._steps_at(z)
        moved: list[Float64] = []
        for column in columns:
            other = z.copy()
            other[column] += steps[column]
            moved.append(other)
        residual, change = self.problem.moved(
            self.variant(z), [self.variant(each) for each in moved], segments, is_rough
        )
        towards = (np.reshape(moved, (len(moved), self.size)) - z) / self.priors
        found = np.concatenate([change, towards], axis=1)
        return np.r_[residual, z / self.priors], found.T / steps[list(columns)]

    def _steps_at(self, z: Float64) -> Float64:
        """Return float64[n], of difference quotients at a vector, within bounds.

        What a turn far on in a recording does, a step of the usual size would leave far behind.
        """
        steps = self.steps
        for candidate in self.candidates:
            quantities = candidate.effect.quantities(self.problem.subject, candidate.place)
            names = [each.name for each in quantities]
            first = self.where(candidate).start
            for index, each in enumerate(quantities, first):
                if each.phase and z[index] > 0.0:
                    interval, phase = z[index] * each.probe, names.index(each.phase)
                    steps[index] = _OF_TURN * interval**2 / self._longest / each.probe
                    steps[first + phase] = _OF_TURN / quantities[phase].probe
        return np.where(z + steps > self.bounds[1], -steps, steps)

    @property
    def _longest(self) -> float:
        """Return how long the longest recording is (s)."""
        parts = (segment.recorded for segment in self.problem.segments)
        return max(part.begin + float(part.joints_at[-1]) for part in parts)
