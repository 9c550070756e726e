"""What a correlation with the spread of scores would be if people differed in their mean only."""

import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.finding import Estimate, Finding
from shared.study.analysis.intervals import TAIL

Floats = NDArray[np.float64]
SHUFFLES = 1999


def shuffled_variance(
    scores: Floats, generator: np.random.Generator, shuffles: int = SHUFFLES
) -> tuple[Finding, ...]:
    """Return whether variance goes with maximum more than games shuffled between people give.

    The maximum of a person's games grows with their variance by itself. Here each person keeps the
    mean, and deviations from it are dealt out anew; p is the share of deals with a correlation at
    least as large, one-sided. Nothing below four people with three games.

    Args:
        scores: float64[n, k]; NaN where a game is missing.
        generator: deals.
        shuffles: how often.
    """
    there = np.isfinite(scores)
    kept = scores[there.sum(axis=1) >= 3]
    there = np.isfinite(kept)
    if len(kept) < 4:
        return ()
    count = there.sum(axis=1)
    means = np.where(there, kept, 0.0).sum(axis=1) / count
    # A deviation from the mean of m games is smaller by sqrt((m - 1) / m): undone before dealing.
    deviations = ((kept - means[:, None]) * np.sqrt(count / (count - 1.0))[:, None])[there]
    if not np.ptp(deviations):
        return ()
    found = _correlation(kept[None])[0]
    dealt = np.full((shuffles, *kept.shape), np.nan)
    for k in range(shuffles):
        dealt[k][there] = generator.permutation(deviations)
    dealt += means[:, None]
    values = _correlation(dealt)
    values = values[np.isfinite(values)]
    low, high = (float(end) for end in np.quantile(values, [TAIL, 1.0 - TAIL]))
    return (
        Finding(
            question="variance and maximum, beyond what shuffled games give",
            test=f"permutation, {shuffles} shuffles, one-sided",
            n=len(kept),
            symbol="r",
            statistic=float(found),
            p=float((1 + np.sum(values >= found - 1e-12)) / (1 + len(values))),
            estimate=Estimate(
                name="r of shuffled games", value=float(values.mean()), low=low, high=high,
                method="2.5 % to 97.5 % of the shuffles",
            ),
        ),
    )  # fmt: skip


def _correlation(cubes: Floats) -> Floats:
    """Return float64[R], the correlation over people of variance and maximum.

    Args:
        cubes: float64[R, n, k]; NaN where a game is missing.
    """
    variance = np.nanvar(cubes, axis=2, ddof=1)
    largest = np.nanmax(cubes, axis=2)
    x = variance - variance.mean(axis=1, keepdims=True)
    y = largest - largest.mean(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", divide="ignore"):
        return (x * y).sum(axis=1) / np.sqrt((x**2).sum(axis=1) * (y**2).sum(axis=1))
