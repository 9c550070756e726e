"""How well a bout tells whose it was: policies classified from the eight features.

A linear discriminant (features standardised, covariance shrunk after Ledoit & Wolf) guesses the
policy of bouts it was not fitted to. Twice: on folds drawn at random, each with the same share of
every policy; and with all bouts against one opponent held out at a time, which is harder and closer
to the use, because people are opponents the policies have never met. The interval of the first is
Wilson's (1927) for single bouts. In the second, bouts against one opponent share their fate, so
whole opponents are drawn (bootstrap).
"""

# pyright: basic
# (scikit-learn has no types)

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.model_selection import LeaveOneGroupOut, StratifiedKFold, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from shared.errors import RiposteError
from shared.styles.sample import StyleSample

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
FOLDS = 10
RESAMPLES = 2000
_Z = 1.959964
"""97.5 % quantile of the standard normal distribution."""


@dataclasses.dataclass(frozen=True)
class Accuracy:
    """How many bouts were given to the policy that played them."""

    share: float
    low: float
    """95 % interval."""
    high: float
    folds: int
    confusion: Ints
    """int64[n, n], bouts of policy i (row) that were taken for policy j's (column)."""


@dataclasses.dataclass(frozen=True)
class Separability:
    """How well policies can be told apart by a bout's features."""

    policies: tuple[str, ...]
    bouts: int
    chance: float
    """Share that always naming the commonest policy gets right."""
    random_folds: Accuracy
    by_opponent: Accuracy | None
    """With one opponent's bouts held out at a time; None where there is only one."""


def separability(sample: StyleSample, generator: np.random.Generator) -> Separability:
    """Return how well the sample's policies can be told apart.

    Args:
        sample: the bouts.
        generator: draws the folds, and the opponents of the bootstrap.

    Raises:
        RiposteError: fewer than two policies.
    """
    if len(sample.policies) < 2:
        raise RiposteError(f"telling policies apart takes two, there is {len(sample.policies)}")
    count = min(FOLDS, int(sample.counts.min()))
    folds = StratifiedKFold(count, shuffle=True, random_state=int(generator.integers(1 << 31)))
    guesses = _guess(sample, folds.split(sample.features, sample.policy))
    right = guesses == sample.policy
    low, high = wilson(int(right.sum()), len(right))
    return Separability(
        policies=sample.policies,
        bouts=len(right),
        chance=float(sample.counts.max() / len(right)),
        random_folds=Accuracy(
            float(right.mean()), low, high, count, _confusion(sample.policy, guesses)
        ),
        by_opponent=_by_opponent(sample, generator),
    )


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927)."""
    share = successes / trials
    centre = share + _Z**2 / (2 * trials)
    half = _Z * math.sqrt(share * (1 - share) / trials + _Z**2 / (4 * trials**2))
    size = 1 + _Z**2 / trials
    return max(0.0, (centre - half) / size), min(1.0, (centre + half) / size)


def _by_opponent(sample: StyleSample, generator: np.random.Generator) -> Accuracy | None:
    """Return the accuracy on opponents that the classifier has not seen."""
    opponents = np.unique(sample.opponent)
    for opponent in opponents:
        left = sample.policy[sample.opponent != opponent]
        if len(np.unique(left)) < len(sample.policies):
            return None  # a policy met nobody else
    folds = LeaveOneGroupOut().split(sample.features, sample.policy, sample.opponent)
    guesses = _guess(sample, folds)
    right = guesses == sample.policy
    trials = np.array([(sample.opponent == one).sum() for one in opponents])
    hits = np.array([right[sample.opponent == one].sum() for one in opponents])
    drawn = generator.integers(0, len(opponents), (RESAMPLES, len(opponents)))
    shares = hits[drawn].sum(axis=1) / trials[drawn].sum(axis=1)
    low, high = np.quantile(shares, [0.025, 0.975])
    confusion = _confusion(sample.policy, guesses)
    return Accuracy(float(right.mean()), float(low), float(high), len(opponents), confusion)


def _guess(sample: StyleSample, folds: Any) -> Ints:
    """Return int64[B], whose each bout seems to be to a classifier that has not seen it."""
    discriminant = LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")
    pipeline = make_pipeline(StandardScaler(), discriminant)
    guesses = cross_val_predict(pipeline, sample.features, sample.policy, cv=folds)
    return np.asarray(guesses, np.int64)


def _confusion(truth: Ints, guesses: Ints) -> Ints:
    size = int(truth.max()) + 1
    table = np.zeros((size, size), np.int64)
    np.add.at(table, (truth, guesses), 1)
    return table
