"""Which three protagonists to send to people (paper: "the three most separable policies").

The paper gives no criterion; ours is stated here. In the space of the first three components, the
distance of two policies is that of their mean styles in units of how much one policy's style varies
from bout to bout, d^2 = (m_i - m_j)^T W^-1 (m_i - m_j), W the covariance of bouts about their own
policy's mean, pooled over the policies (Mahalanobis 1936; Fisher's discriminant measures the same).
The three whose *smallest* distance is largest are selected: an opponent that cannot be told from
another is no new opponent, and a mean of distances would forgive that. All triples are compared.
Of triples with the same smallest distance the larger mean distance wins, then the order of names.
"""

import dataclasses
import itertools

import numpy as np
from numpy.typing import NDArray

from shared.errors import RiposteError
from shared.styles.components import Components
from shared.styles.sample import StyleSample, pooled_covariance

Floats = NDArray[np.float64]
SELECTED = 3
CRITERION = (
    "largest smallest Mahalanobis distance between two of the three, in three components, "
    "in standard deviations from bout to bout"
)
_RIDGE = 1e-9
"""Share of the largest variance added along every axis, for policies that never vary."""
_DIGITS = 9
"""Decimal digits that count when two triples are compared."""


@dataclasses.dataclass(frozen=True)
class Triple:
    """Three policies and how far apart they are."""

    policies: tuple[str, str, str]
    smallest: float
    """Smallest of their three distances, what is maximised."""
    mean: float


@dataclasses.dataclass(frozen=True)
class Selection:
    """The three most separable policies, and what they were compared with."""

    triples: tuple[Triple, ...]
    """All of them, best first."""
    policies: tuple[str, ...]
    distances: Floats
    """float64[n, n] between the policies."""

    @property
    def chosen(self) -> Triple:
        """Return the selected three."""
        return self.triples[0]


def distances_between(sample: StyleSample, components: Components) -> Floats:
    """Return float64[n, n], how far apart the policies are, in standard deviations of bouts."""
    scores = components.project(sample.features)
    means = components.project(sample.means())
    within = pooled_covariance(scores, sample.policy)
    between = means - means.mean(axis=0)
    largest = max(float(np.trace(within)), float((between**2).sum()))
    within += _RIDGE * largest * np.eye(within.shape[0])
    whitened = np.linalg.solve(np.linalg.cholesky(within), means.T).T
    return np.sqrt(((whitened[:, None] - whitened[None]) ** 2).sum(axis=-1))


def select(sample: StyleSample, components: Components) -> Selection:
    """Return the three most separable of the sample's policies.

    Raises:
        RiposteError: there are fewer than three.
    """
    names = sample.policies
    if len(names) < SELECTED:
        raise RiposteError(
            f"selecting {SELECTED} protagonists needs at least {SELECTED}, this run has "
            f"{len(names)}; train it with --phase all --rounds 6"
        )
    distances = distances_between(sample, components)
    triples: list[Triple] = []
    for i, j, k in itertools.combinations(range(len(names)), SELECTED):
        sides = np.array([distances[i, j], distances[i, k], distances[j, k]])
        triples.append(
            Triple((names[i], names[j], names[k]), float(sides.min()), float(sides.mean()))
        )
    triples.sort(key=lambda t: (-round(t.smallest, _DIGITS), -round(t.mean, _DIGITS), t.policies))
    return Selection(tuple(triples), names, distances)
