"""Bouts of several policies as a table of features: what every analysis of styles starts from."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shared.errors import RiposteError
from shared.styles.features import FEATURES

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclasses.dataclass(frozen=True)
class StyleSample:
    """B bouts of n policies, each against one of m opponents.

    Every policy has at least two bouts; every number is finite.
    """

    policies: tuple[str, ...]
    """Names of the n policies."""
    opponents: tuple[str, ...]
    """Names of the m opponents."""
    policy: Ints
    """int64[B], index into ``policies``."""
    opponent: Ints
    """int64[B], index into ``opponents``."""
    features: Floats
    """float64[B, 8], in the order and units of ``shared.styles.features.FEATURES``."""

    def __post_init__(self) -> None:
        """Check the table.

        Raises:
            RiposteError: a shape, an index or a number that cannot be, or a policy with fewer than
                two bouts; names which.
        """
        bouts = len(self.policy)
        if self.features.shape != (bouts, len(FEATURES)) or self.opponent.shape != (bouts,):
            raise RiposteError(
                f"features of {bouts} bouts must be [{bouts}, {len(FEATURES)}] with an opponent "
                f"each, not {list(self.features.shape)} with {len(self.opponent)} opponents"
            )
        if not np.isfinite(self.features).all():
            bout, feature = (int(k) for k in np.argwhere(~np.isfinite(self.features))[0])
            raise RiposteError(
                f"bout {bout} of {self.policies[self.policy[bout]]} has "
                f"{FEATURES[feature].name} {self.features[bout, feature]}, expected a finite "
                "number; play the tournament again"
            )
        for name, count in zip(self.policies, self.counts, strict=True):
            if count < 2:
                raise RiposteError(
                    f"bouts of {name} in the table: {count}, its style needs at least 2; "
                    "finish the tournament"
                )

    @staticmethod
    def of(policies: Sequence[str], opponents: Sequence[str], features: Floats) -> "StyleSample":
        """Return the sample of bouts given by the names of who played, in order of appearance.

        Args:
            policies: str[B].
            opponents: str[B].
            features: float64[B, 8].
        """
        names, others = tuple(dict.fromkeys(policies)), tuple(dict.fromkeys(opponents))
        return StyleSample(
            policies=names,
            opponents=others,
            policy=np.array([names.index(name) for name in policies], np.int64),
            opponent=np.array([others.index(name) for name in opponents], np.int64),
            features=np.asarray(features, np.float64),
        )

    @property
    def counts(self) -> Ints:
        """Return int64[n], bouts of each policy."""
        return np.bincount(self.policy, minlength=len(self.policies))

    def bouts_of(self, policy: int) -> Floats:
        """Return float64[K, 8], the bouts of one policy."""
        return self.features[self.policy == policy]

    def means(self) -> Floats:
        """Return float64[n, 8], each policy's style: the mean over its bouts (the paper's)."""
        return np.stack([self.bouts_of(k).mean(axis=0) for k in range(len(self.policies))])

    def spreads(self) -> Floats:
        """Return float64[n, 8], the standard deviation over each policy's bouts."""
        return np.stack([self.bouts_of(k).std(axis=0, ddof=1) for k in range(len(self.policies))])

    def subset(self, policies: Sequence[str]) -> "StyleSample":
        """Return the bouts of these policies, in their order."""
        indices = [self.policies.index(name) for name in policies]
        chosen = np.isin(self.policy, indices)
        place = np.full(len(self.policies), -1)
        place[indices] = np.arange(len(indices))
        return StyleSample(
            policies=tuple(policies),
            opponents=self.opponents,
            policy=place[self.policy[chosen]],
            opponent=self.opponent[chosen],
            features=self.features[chosen],
        )


def pooled_covariance(values: Floats, policy: Ints) -> Floats:
    """Return float64[k, k], the covariance of bouts about the mean of their own policy.

    Args:
        values: float64[B, k].
        policy: int64[B], whose bout each is.
    """
    groups = np.unique(policy)
    products = np.zeros((values.shape[1], values.shape[1]))
    for group in groups:
        own = values[policy == group]
        centred = own - own.mean(axis=0)
        products += centred.T @ centred
    return products / (len(values) - len(groups))
