"""Principal components of styles (paper: three of them, with less than 2 % of information lost).

Features have different units, so each is standardised over all bouts; not over the few means, where
a feature in which the policies do not differ would be blown up to the size of the others. Then the
components are fitted to the policies' *mean* styles, because that is what the paper calls a style
and what it compares; every policy counts once, however many bouts it played. Bouts, and policies
that were not part of the fit (the warm start), are projected by the same map. n policies lie in at
most n - 1 dimensions: of four, three components lose nothing whatever they are. What components
fitted to single bouts would keep is given beside it: there the chance of play counts too.
"""

# pyright: basic
# (scikit-learn has no types)

import dataclasses

import numpy as np
from numpy.typing import NDArray
from sklearn.decomposition import PCA
from sklearn.preprocessing import StandardScaler

from shared.errors import RiposteError
from shared.styles.features import FEATURES
from shared.styles.sample import StyleSample

Floats = NDArray[np.float64]
KEPT = 3
"""Components of the paper."""
GOAL = 0.98
"""Least share of the variance that they are to keep."""
_FLAT = 1e-9
"""Relative spread below which policies count as one style."""


@dataclasses.dataclass(frozen=True)
class Components:
    """The map from features to components, and how much each component tells."""

    centre: Floats
    """float64[8], mean of the policies' styles."""
    scale: Floats
    """float64[8], standard deviation over all bouts; 1 where they do not differ."""
    axes: Floats
    """float64[c, 8], unit vectors in standardised features, most telling first; c <= 8."""
    shares: Floats
    """float64[c], share of the policies' variance along each, adding up to 1."""
    bout_shares: Floats
    """float64[8], the shares of components fitted to single bouts instead."""
    policies: int
    """How many it was fitted to."""

    def project(self, features: Floats, kept: int = KEPT) -> Floats:
        """Return float64[..., k], the first components of features float64[..., 8].

        ``k`` is ``kept``, or as many components as there are.
        """
        return ((features - self.centre) / self.scale) @ self.axes[:kept].T

    def information(self, kept: int = KEPT) -> float:
        """Return the share of the policies' variance that the first components keep."""
        return float(min(1.0, self.shares[:kept].sum()))

    def needed(self, goal: float = GOAL) -> int:
        """Return how many components it takes to keep this share."""
        return next(k for k in range(1, 9) if self.information(k) >= goal - 1e-12)

    def loudest(self, component: int, count: int = 3) -> list[str]:
        """Return the titles of the features that weigh most in a component."""
        order = np.argsort(-np.abs(self.axes[component]), kind="stable")
        return [FEATURES[k].title for k in order[:count]]

    def why_not(self) -> str:
        """Return why three components lose more than the paper's 2 %; empty when they do not."""
        if self.information() >= GOAL - 1e-12:
            return ""
        lost = 1.0 - self.information()
        return (
            f"Three components lose {lost:.1%} of what tells the {self.policies} policies apart, "
            f"more than the paper's 2 %: these policies differ in more than three independent "
            f"ways. The fourth holds {self.shares[KEPT]:.1%}, mostly "
            f"{', '.join(self.loudest(KEPT))}; {self.needed()} components keep {GOAL:.0%}."
        )


def fit_components(sample: StyleSample) -> Components:
    """Return the components of these policies' styles.

    Raises:
        RiposteError: fewer than two policies, or all of them move alike.
    """
    means = sample.means()
    if len(means) < 2:
        raise RiposteError(
            f"components need at least 2 policies to compare, there is {len(means)}; "
            "train more rounds"
        )
    size = np.abs(means).max(axis=0)
    if (np.ptp(means, axis=0) <= _FLAT * size).all():
        raise RiposteError(
            f"the mean styles of all {len(means)} policies are the same; are they one policy?"
        )
    scaler = StandardScaler().fit(sample.features)
    fitted = PCA(svd_solver="full").fit(scaler.transform(means))
    bouts = PCA(svd_solver="full").fit(scaler.transform(sample.features))
    axes = _signed(np.asarray(fitted.components_))
    return Components(
        centre=means.mean(axis=0),
        scale=np.asarray(scaler.scale_),
        axes=axes,
        shares=np.asarray(fitted.explained_variance_ratio_),
        bout_shares=np.asarray(bouts.explained_variance_ratio_),
        policies=len(means),
    )


def _signed(axes: Floats) -> Floats:
    """Return the axes pointing so that the largest weight of each is above zero."""
    largest = np.abs(axes).argmax(axis=1)
    return axes * np.sign(axes[np.arange(len(axes)), largest])[:, None]
