"""How well a bout tells whose it was: policies classified from the eight features.

A classifier guesses the policy of bouts it was not fitted to. On folds drawn at random, each with
the same share of every policy, it is a support vector machine (radial basis, scikit-learn's
defaults, features standardised): a policy moves in one way against each opponent, so its bouts are
several clouds, which no plane parts. A linear discriminant (covariance shrunk after Ledoit & Wolf)
on the same folds says how much planes part. It also answers for all bouts against one opponent held
out at a time, which is harder and closer to the use, because people are opponents the policies have
never met: clouds of other opponents are of no help there. The interval of random folds is Wilson's
(1927) for single bouts. Bouts against one opponent share their fate, so there whole opponents are
drawn (bootstrap).
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
from sklearn.svm import SVC

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
    """By the support vector machine."""
    linear: Accuracy
    """On the same folds, by the linear discriminant."""
    by_opponent: Accuracy | None
    """By the linear discriminant, with one opponent's bouts held out at a time; None where there is
    only one."""


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
    shuffled = StratifiedKFold(count, shuffle=True, random_state=int(generator.integers(1 << 31)))
    folds = list(shuffled.split(sample.features, sample.policy))
    return Separability(
        policies=sample.policies,
        bouts=len(sample.policy),
        chance=float(sample.counts.max() / len(sample.policy)),
        random_folds=_on_folds(sample, SVC(), folds),
        linear=_on_folds(sample, _discriminant(), folds),
        by_opponent=_by_opponent(sample, generator),
    )


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % interval of a share (Wilson 1927)."""
    share = successes / trials
    centre = share + _Z**2 / (2 * trials)
    half = _Z * math.sqrt(share * (1 - share) / trials + _Z**2 / (4 * trials**2))
    size = 1 + _Z**2 / trials
    return max(0.0, (centre - half) / size), min(1.0, (centre + half) / size)


def _on_folds(sample: StyleSample, classifier: Any, folds: list[Any]) -> Accuracy:
    guesses = _guess(sample, classifier, folds)
    right = guesses == sample.policy
    low, high = wilson(int(right.sum()), len(right))
    confusion = _confusion(sample.policy, guesses)
    return Accuracy(float(right.mean()), low, high, len(folds), confusion)


def _discriminant() -> Any:
    return LinearDiscriminantAnalysis(solver="lsqr", shrinkage="auto")


def _by_opponent(sample: StyleSample, generator: np.random.Generator) -> Accuracy | None:
    """Return the accuracy on opponents that the classifier has not seen."""
    opponents = np.unique(sample.opponent)
    for opponent in opponents:
        left = sample.policy[sample.opponent != opponent]
        if len(np.unique(left)) < len(sample.policies):
            return None  # a policy met nobody else
    folds = LeaveOneGroupOut().split(sample.features, sample.policy, sample.opponent)
    guesses = _guess(sample, _discriminant(), folds)
    right = guesses == sample.policy
    trials = np.array([(sample.opponent == one).sum() for one in opponents])
    hits = np.array([right[sample.opponent == one].sum() for one in opponents])
    drawn = generator.integers(0, len(opponents), (RESAMPLES, len(opponents)))
    shares = hits[drawn].sum(axis=1) / trials[drawn].sum(axis=1)
    low, high = np.quantile(shares, [0.025, 0.975])
    confusion = _confusion(sample.policy, guesses)
    return Accuracy(float(right.mean()), float(low), float(high), len(opponents), confusion)


def _guess(sample: StyleSample, classifier: Any, folds: Any) -> Ints:
    """Return int64[B], whose each bout seems to be to a classifier that has not seen it."""
    pipeline = make_pipeline(StandardScaler(), classifier)
    guesses = cross_val_predict(pipeline, sample.features, sample.policy, cv=folds)
    return np.asarray(guesses, np.int64)


def _confusion(truth: Ints, guesses: Ints) -> Ints:
    size = int(truth.max()) + 1
    table = np.zeros((size, size), np.int64)
    np.add.at(table, (truth, guesses), 1)
    return table
