"""The reward of one step: the game score and, in phase one, a continuous part.

The paper gives no formula for its continuous reward; each term here is bounded in [0, 1] and
turns one question of the game into a slope: is my bat near the target, is my bat near the
attacking bat, did I keep out of the target.
"""

import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.game.bout import Judgement

Floats = NDArray[np.float64]


class RewardConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How a step is turned into a reward (section ``[reward]``)."""

    score_scale: float = 0.1
    """Reward for one point of the game; keeps the +-10 of penalty and camping near one."""
    reach: float = 0.5
    """Distance (m) at which the closeness terms have fallen to 1/e."""
    guard_weight: float = 0.25
    """Share of the protagonist's shaping that is for staying close to an attacking bat."""
    keep_out: float = 0.1
    """Distance from the target (m) from which the protagonist's bat is well out of it."""
    lure_weight: float = 0.0
    """Share of the camping award that rewards the antagonist as long as there is a continuous
    part. At 1 it learns in phase one to lure a naive protagonist into camping, ten points a step,
    instead of to attack; the game score alone (phase two) always pays in full."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        if self.score_scale <= 0.0:
            raise ValueError(f"score_scale ({self.score_scale}) must be positive")
        if self.reach <= 0.0:
            raise ValueError(f"reach ({self.reach} m) must be positive")
        if self.keep_out <= 0.0:
            raise ValueError(f"keep_out ({self.keep_out} m) must be positive")
        if not 0.0 <= self.lure_weight <= 1.0:
            raise ValueError(f"lure_weight ({self.lure_weight}) must be in [0, 1]")
        if not 0.0 <= self.guard_weight <= 1.0:
            raise ValueError(f"guard_weight ({self.guard_weight}) must be in [0, 1]")


def closeness(distance: Floats, reach: float) -> Floats:
    """Return exp(-distance / reach) for distances outside, 1 for those inside."""
    return np.exp(np.maximum(distance, 0.0) / -reach)


def antagonist_shaping(judgement: Judgement, cfg: RewardConfig) -> Floats:
    """Return float64[N] in [0, 1]: one with the bat in the target, falling with distance."""
    return closeness(judgement.target_distance[0], cfg.reach)


def protagonist_shaping(judgement: Judgement, cfg: RewardConfig) -> Floats:
    """Return float64[N] in [0, 1]: bat on the attacking bat, and well out of the target itself.

    The way out pays by the centimetre: an attacker who lures the bat to and fro across the edge
    would otherwise make it camp (ten points a step) where a step inside or outside tells nothing.
    """
    guard = closeness(judgement.bat_distance, cfg.reach)
    out = np.clip(judgement.target_distance[1] / cfg.keep_out, 0.0, 1.0)
    return cfg.guard_weight * guard + (1.0 - cfg.guard_weight) * out


def reward(
    side: int, judgement: Judgement, score_weight: float, shaping_weight: float, cfg: RewardConfig
) -> Floats:
    """Return one side's reward for a step: weighted sum of game score and continuous part.

    Args:
        side: 0 for the antagonist, who wants the score, 1 for the protagonist, who does not.
        judgement: the step.
        score_weight: factor of the scaled game score.
        shaping_weight: factor of the continuous part; 0 in phase two of the paper.
        cfg: scales.

    Returns:
        float64[N].
    """
    sign = 1.0 if side == 0 else -1.0
    scale = sign * score_weight * cfg.score_scale
    if shaping_weight == 0.0:
        return scale * judgement.points
    if side == 1:
        return scale * judgement.points + shaping_weight * protagonist_shaping(judgement, cfg)
    points = judgement.points - (1.0 - cfg.lure_weight) * judgement.camping_points
    return scale * points + shaping_weight * antagonist_shaping(judgement, cfg)
