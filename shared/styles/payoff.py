"""The payoff matrix of a tournament: what each antagonist scores against each protagonist.

Intervals are percentiles of means over bouts drawn again with replacement (Efron 1979), pairing
by pairing; the generator is an argument, so the same bouts always give the same numbers.
"""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from shared.styles.bouts import BoutTable

Floats = NDArray[np.float64]
Longs = NDArray[np.int64]

RESAMPLES = 2000
COVERAGE = (0.025, 0.975)
"""Quantiles of a 95 % interval."""
_CHUNK = 1 << 21
"""Bouts drawn at once."""


@dataclasses.dataclass(frozen=True)
class Payoff:
    """A antagonists against P protagonists; NaN where a pairing has no bout yet."""

    antagonists: tuple[str, ...]
    protagonists: tuple[str, ...]
    """Player references."""
    bouts: Longs
    """int64[A, P]."""
    wins: Longs
    """int64[A, P], bouts with a score above 0: won by the antagonist."""
    mean: Floats
    """float64[A, P], points a bout."""
    low: Floats
    high: Floats
    """float64[A, P], 95 % interval of the mean."""
    attack_points: Floats
    """float64[A, P], mean points a bout by the rule that gave them; so are the next two."""
    penalty_points: Floats
    camping_points: Floats
    camping_share: Floats
    """float64[A, P], of all points given and taken, how much camping gave."""
    in_target_share: Floats
    """float64[A, P], of all steps, those with the antagonist's bat in the target."""
    resampled: Floats
    """float64[RESAMPLES, A, P], means over bouts drawn again."""

    @property
    def is_complete(self) -> bool:
        """Return whether every pairing has bouts."""
        return bool((self.bouts > 0).all())


def payoff_of(table: BoutTable, generator: np.random.Generator) -> Payoff:
    """Return the payoff matrix of some bouts.

    Args:
        table: the bouts.
        generator: draws them again.
    """
    shape = (len(table.antagonists), len(table.protagonists))
    rules = table.provenance.game
    pairing = table.antagonist * np.int64(shape[1]) + table.protagonist
    cells = shape[0] * shape[1]
    bouts = np.bincount(pairing, minlength=cells).reshape(shape)

    def mean(values: NDArray[np.generic]) -> Floats:
        totals = np.bincount(pairing, values.astype(np.float64), minlength=cells).reshape(shape)
        return np.divide(totals, bouts, out=np.full(shape, np.nan), where=bouts > 0)

    attack = rules.point * mean(table.attack_steps)
    penalty = rules.penalty * mean(table.penalty_steps)
    camping = rules.camping_award * mean(table.camping_steps)
    moved = np.abs(attack) + np.abs(penalty) + np.abs(camping)
    resampled = resampled_means(table, generator)
    low, high = np.quantile(resampled, COVERAGE, axis=0)
    return Payoff(
        antagonists=table.antagonists,
        protagonists=table.protagonists,
        bouts=bouts,
        wins=np.bincount(pairing, table.score > 0.0, minlength=cells)
        .astype(np.int64)
        .reshape(shape),
        mean=mean(table.score),
        low=low,
        high=high,
        attack_points=attack,
        penalty_points=penalty,
        camping_points=camping,
        camping_share=np.divide(
            np.abs(camping), moved, out=np.where(bouts > 0, 0.0, np.nan), where=moved > 0.0
        ),
        in_target_share=mean(table.attack_steps + table.penalty_steps) / rules.bout_steps,
        resampled=resampled,
    )


def resampled_means(table: BoutTable, generator: np.random.Generator) -> Floats:
    """Return float64[RESAMPLES, A, P], mean scores of bouts drawn with replacement."""
    means = np.full((RESAMPLES, len(table.antagonists), len(table.protagonists)), np.nan)
    for one in range(len(table.antagonists)):
        for two in range(len(table.protagonists)):
            scores = table.score[table.pairing(one, two)].astype(np.float64)
            if not len(scores):
                continue
            step = max(1, _CHUNK // len(scores))
            for start in range(0, RESAMPLES, step):
                rows = min(step, RESAMPLES - start)
                drawn = generator.integers(0, len(scores), (rows, len(scores)))
                means[start : start + rows, one, two] = scores[drawn].mean(axis=1)
    return means
