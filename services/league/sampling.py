"""Whom an agent meets next: pure functions of the candidates and a seed.

Phase two draws an opponent from the versions that the other side has left in this round. The
roles are asymmetric, so each side has a pool of its own. The paper draws uniformly and from
history only (Yang et al. 2021, section 3.1); scripted players join only where a site file names
them, and then never leave.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Sampler = Literal["latest", "uniform", "window", "pfsp", "fixed"]
SAMPLERS: tuple[Sampler, ...] = ("latest", "uniform", "window", "pfsp", "fixed")

_DRAWS = 0xD4A3
"""Keeps the draws apart from everything else that is made of the run's seed."""


@dataclasses.dataclass(frozen=True)
class Pool:
    """Who can be drawn, and what is known of them."""

    history: tuple[str, ...]
    """Player references, oldest first; the first is the warm start."""
    results: Mapping[str, Sequence[float]] = dataclasses.field(
        default_factory=dict[str, Sequence[float]]
    )
    """What the learner made of each of them so far in this round: the mean reward of each update
    played against it, the higher the better for the learner."""
    anchors: tuple[str, ...] = ()
    """Scripted players that never leave."""


@dataclasses.dataclass(frozen=True)
class Rule:
    """How to draw from a pool."""

    sampler: Sampler = "uniform"
    window: int = 8
    """Newest versions that ``window`` draws from."""
    power: float = 2.0
    """Exponent of ``pfsp``."""
    anchor_share: float = 0.1
    """Probability that an anchor is drawn, when there are any."""


def probabilities(rule: Rule, pool: Pool) -> NDArray[np.float64]:
    """Return the probability of each player of a pool, history first, then anchors.

    ``latest`` takes the newest, ``fixed`` always the warm start, ``uniform`` any with the same
    probability, ``window`` any of the newest few. ``pfsp`` is prioritised fictitious self-play
    (Vinyals et al. 2019, methods, "f_hard"): weight (1 - win rate)^power.

    Returns:
        float64[len(history) + len(anchors)], summing to one.

    Raises:
        ValueError: if the history is empty.
    """
    count = len(pool.history)
    if not count:
        raise ValueError("the pool has no history; it begins with the warm start")
    weights = np.zeros(count)
    if rule.sampler == "latest":
        weights[-1] = 1.0
    elif rule.sampler == "fixed":
        weights[0] = 1.0
    elif rule.sampler == "window":
        weights[-rule.window :] = 1.0
    elif rule.sampler == "pfsp":
        weights = (1.0 - win_rates(pool)) ** rule.power
    else:
        weights[:] = 1.0
    weights /= weights.sum()
    if not pool.anchors:
        return weights
    anchors = np.full(len(pool.anchors), rule.anchor_share / len(pool.anchors))
    return np.concatenate([weights * (1.0 - rule.anchor_share), anchors])


def win_rates(pool: Pool) -> NDArray[np.float64]:
    """Return float64[K] in (0, 1), how well the learner does against each version of the history.

    A bout of this game has a score and no winner. An update counts as won when its mean reward is
    above the median of the learner's updates in this round, as half a win when it equals it. One
    win and one loss are added to each record (Laplace), so that a version not met yet has 0.5 and
    no rate is 0 or 1.
    """
    known = [value for ref in pool.history for value in pool.results.get(ref, ())]
    par = float(np.median(known)) if known else 0.0
    rates = np.empty(len(pool.history))
    for index, ref in enumerate(pool.history):
        values = np.array(pool.results.get(ref, ()), np.float64)
        wins = float(np.sum(values > par) + 0.5 * np.sum(values == par))
        rates[index] = (wins + 1.0) / (len(values) + 2.0)
    return rates


def draw(rule: Rule, pool: Pool, seed: int, index: int) -> str:
    """Return the player drawn; the same arguments give the same player for ever.

    Args:
        rule: how to draw.
        pool: from whom.
        seed: of the run.
        index: of the stage the opponent is for.
    """
    generator = np.random.default_rng(np.random.SeedSequence((seed, _DRAWS, index)))
    players = (*pool.history, *pool.anchors)
    edges = np.cumsum(probabilities(rule, pool))
    # The last edge is 1 but for rounding; whoever has probability 0 owns no stretch.
    place = int(np.count_nonzero(edges <= generator.random() * edges[-1]))
    return players[min(place, len(players) - 1)]
