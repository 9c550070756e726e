"""How many styles a library holds, and how far apart they are.

Two numbers, both of the policies' mean styles in standardised features, where the distance of two
policies is the root mean square over the eight features of their difference, each feature in units
of a common *yardstick*: how much it varies from bout to bout within a policy.

- **Distance**: the mean over all pairs of policies.
- **Effective number of styles**: the Vendi score (Friedman & Dieng 2023, TMLR), the exponential of
  the entropy of the eigenvalues of K / n, with the similarity K_ij = exp(-d_ij^2 / 2). It is 1 when
  all move alike and n when none resembles another; policies one yardstick apart in every feature
  have similarity 0.61.

Libraries are compared by one yardstick for both, or the more erratic one measures itself shorter.
The intervals come from drawing bouts anew within each policy and opponent: they say how well this
library's diversity is known, not what another training would give. Noise only ever drives means
apart, so drawing anew overshoots just as the sample did; the basic bootstrap (Davison & Hinkley
1997, eq. 5.6), which reflects the drawn values at the measured one, takes that out.
"""

import dataclasses

import numpy as np
from numpy.typing import NDArray

from shared.errors import RiposteError
from shared.styles.sample import StyleSample

Floats = NDArray[np.float64]
RESAMPLES = 1000


@dataclasses.dataclass(frozen=True)
class Measure:
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Diversity:
    """How diverse a library of policies is."""

    policies: int
    distance: Measure
    """Mean distance of two policies, in yardsticks."""
    effective_styles: Measure
    """Vendi score, 1 to ``policies``."""


def yardstick(sample: StyleSample) -> Floats:
    """Return float64[8], each feature's standard deviation within a policy, pooled over policies.

    A feature that never varies within any policy is given that of the policies' means, or 1.
    """
    squares = np.zeros(sample.features.shape[1])
    for policy in range(len(sample.policies)):
        squares += sample.bouts_of(policy).var(axis=0) * sample.counts[policy]
    within = np.sqrt(squares / (len(sample.policy) - len(sample.policies)))
    between = sample.means().std(axis=0)
    return np.where(within > 0.0, within, np.where(between > 0.0, between, 1.0))


def diversity(
    sample: StyleSample, generator: np.random.Generator, scale: Floats | None = None
) -> Diversity:
    """Return how diverse the sample's policies are.

    Args:
        sample: the bouts of a library's policies.
        generator: draws the bootstrap.
        scale: float64[8], yardstick; the sample's own by default. Pass one to compare libraries.

    Raises:
        RiposteError: fewer than two policies.
    """
    if len(sample.policies) < 2:
        raise RiposteError(
            f"the diversity of a library needs at least 2 policies, there is {len(sample.policies)}"
        )
    unit = yardstick(sample) if scale is None else scale
    numbers = _measures(sample.means() / unit)
    drawn = np.array([_measures(means / unit) for means in _resampled(sample, generator)])
    limits = ((0.0, np.inf), (1.0, float(len(sample.policies))))
    distance, styles = (
        _reflected(value, drawn[:, k], *limits[k]) for k, value in enumerate(numbers)
    )
    return Diversity(len(sample.policies), distance, styles)


def vendi_score(similarities: Floats) -> float:
    """Return the effective number of things from float64[n, n], their similarities (1 to itself).

    exp(-sum of l ln l) over the eigenvalues l of K / n (Friedman & Dieng 2023, definition 3.1).
    """
    eigenvalues = np.linalg.eigvalsh(similarities / len(similarities))
    positive = eigenvalues[eigenvalues > 1e-15]
    return float(np.exp(-np.sum(positive * np.log(positive))))


def _reflected(value: float, drawn: Floats, lowest: float, highest: float) -> Measure:
    """Return the measured value with its basic bootstrap interval, within what is possible."""
    below, above = np.quantile(drawn, [0.025, 0.975])
    low, high = np.clip([2 * value - above, 2 * value - below], lowest, highest)
    return Measure(value, float(low), float(high))


def _measures(styles: Floats) -> tuple[float, float]:
    """Return mean distance and Vendi score of float64[n, 8], styles in yardsticks."""
    squared = ((styles[:, None] - styles[None]) ** 2).mean(axis=-1)
    pairs = np.sqrt(squared[np.triu_indices(len(styles), 1)])
    return float(pairs.mean()), vendi_score(np.exp(-0.5 * squared))


def _resampled(sample: StyleSample, generator: np.random.Generator) -> Floats:
    """Return float64[RESAMPLES, n, 8], mean styles of bouts drawn with replacement."""
    sums = np.zeros((RESAMPLES, len(sample.policies), sample.features.shape[1]))
    for policy in range(len(sample.policies)):
        own = sample.policy == policy
        for opponent in np.unique(sample.opponent[own]):
            bouts = sample.features[own & (sample.opponent == opponent)]
            weights = generator.multinomial(
                len(bouts), np.full(len(bouts), 1 / len(bouts)), RESAMPLES
            )
            sums[:, policy] += weights @ bouts
    return sums / sample.counts[:, None]
