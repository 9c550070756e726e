"""Samples of bouts with a known structure."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.styles.sample import StyleSample

Floats = NDArray[np.float64]
TYPICAL = np.array([6.0, 8.0, 5.0, 0.5, 4.0, 300.0, 2.0, -14.0])
"""A style of about the size that real ones have."""
NOISE = 0.05 * np.abs(TYPICAL)
"""Standard deviation of each feature from bout to bout."""


def bouts(
    centres: Sequence[Any],
    *,
    names: Sequence[str] | None = None,
    opponents: int = 6,
    each: int = 20,
    opponent_effect: float = 0.0,
    seed: int = 0,
) -> StyleSample:
    """Return bouts of policies whose styles lie at ``centres``, in units of NOISE from TYPICAL.

    Every opponent moves the features of all policies by ``opponent_effect`` units of its own kind.
    """
    generator = np.random.default_rng(seed)
    names = names or [f"p{k}" for k in range(len(centres))]
    effects = generator.normal(size=(opponents, 8)) * opponent_effect
    policies: list[str] = []
    others: list[str] = []
    rows: list[Floats] = []
    for name, centre in zip(names, centres, strict=True):
        for opponent in range(opponents):
            noise = generator.normal(size=(each, 8))
            rows.append(TYPICAL + NOISE * (np.asarray(centre) + effects[opponent] + noise))
            policies += [name] * each
            others += [f"a{opponent}"] * each
    return StyleSample.of(policies, others, np.concatenate(rows))


def apart(*pairs: tuple[int, float]) -> Floats:
    """Return float64[8], zero but for these (feature, units)."""
    centre = np.zeros(8)
    for feature, units in pairs:
        centre[feature] = units
    return centre


THREE_OF_SIX = (
    apart((0, 0.0), (4, 0.2)),
    apart((0, 8.0)),
    apart((0, 0.2), (5, 0.1)),
    apart((4, 8.0)),
    apart((0, 0.1)),
    apart((5, 8.0)),
)
"""Six policies; 1, 3 and 5 are far apart, the others lie together between them."""
