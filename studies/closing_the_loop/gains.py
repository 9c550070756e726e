"""How much less the antagonists score, with intervals over seeds and bouts."""

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from studies.closing_the_loop.protocol import CONDITIONS, Condition

Floats = NDArray[np.float64]
RESAMPLED: Final = 4000
COVERED: Final = 0.95


@dataclass(frozen=True)
class Estimate:
    """A mean and its 95 % interval."""

    mean: float
    low: float
    high: float

    @property
    def is_sure(self) -> bool:
        """Whether 0 lies outside of the interval."""
        return not self.low <= 0.0 <= self.high


@dataclass(frozen=True)
class Row:
    """One antagonist, or all of them."""

    antagonist: str
    points: dict[Condition, Estimate]
    """Against the protagonists of a condition; fewer is better."""
    gains: dict[Condition, Estimate]
    """How many fewer than against those trained in the nominal model."""


def rows_of(scores: dict[Condition, Floats], antagonists: tuple[str, ...], seed: int) -> list[Row]:
    """Return a row for each antagonist, then one for their mean.

    Args:
        scores: by condition float64[seeds, antagonists, bouts].
        antagonists: their names.
        seed: of the resampling.
    """
    whole = {name: values.mean(axis=1, keepdims=True) for name, values in scores.items()}
    parts = [
        (name, {each: values[:, k : k + 1] for each, values in scores.items()})
        for k, name in enumerate(antagonists)
    ]
    return [_row(name, found, seed) for name, found in [*parts, ("all", whole)]]


def _row(name: str, scores: dict[Condition, Floats], seed: int) -> Row:
    flat = {each: values[:, 0] for each, values in scores.items()}
    nominal = flat["nominal"]
    return Row(
        antagonist=name,
        points={each: _estimate(flat[each], seed) for each in CONDITIONS},
        gains={each: _estimate(nominal - flat[each], seed) for each in CONDITIONS[1:]},
    )


def _estimate(values: Floats, seed: int) -> Estimate:
    """Return the mean of float64[seeds, bouts] with its interval: seeds are drawn, then bouts."""
    rng = np.random.default_rng(seed)
    seeds, bouts = values.shape
    # How often each seed and each bout is drawn. Bouts are the same ones for every protagonist, so
    # they are drawn for all seeds at once.
    of_seeds = rng.multinomial(seeds, np.full(seeds, 1.0 / seeds), RESAMPLED) / seeds
    of_bouts = rng.multinomial(bouts, np.full(bouts, 1.0 / bouts), RESAMPLED) / bouts
    means = np.einsum("rs,rs->r", of_seeds, of_bouts @ values.T)
    low, high = np.quantile(means, [0.5 * (1.0 - COVERED), 0.5 * (1.0 + COVERED)])
    return Estimate(float(values.mean()), float(low), float(high))
