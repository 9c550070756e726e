"""Which opponents phase two drew, replayed from the ledger, and whether the draws fit the sampler.

The pool of each draw is rebuilt from the events before it, so that the probabilities are those the
league had. Each pool is cut into ``BINS`` parts of (nearly) equal length, oldest first; how often
each part was drawn is compared with how often it should have been (Pearson's chi-square). Pools
differ from draw to draw, so the p value comes from draws simulated with the same probabilities
instead of the chi-square distribution.
"""

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from services.league.events import Entry, StageStarted
from services.league.history import RunState
from services.league.rounds import Turn, pool_of
from services.league.sampling import draw, probabilities
from shared.messages.training import Agent

BINS = 5
"""Parts of a history, oldest to newest; scripted anchors are one more."""
SIMULATIONS = 4000


@dataclasses.dataclass(frozen=True)
class Draw:
    """One opponent drawn in phase two."""

    round: int
    iteration: int
    agent: Agent
    """Who learned against it."""
    place: int
    """In the pool: 0 is the warm start, the newest of the history comes last, then anchors."""
    history: int
    """Length of the history it was drawn from."""
    probabilities: NDArray[np.float64]
    """float64[history + anchors], as the sampler had them."""
    is_replayed: bool
    """The sampler, asked again, gives the same opponent."""


@dataclasses.dataclass(frozen=True)
class DrawTest:
    """How draws compare with their sampler."""

    draws: int
    observed: tuple[int, ...]
    """By part of the history, oldest first; anchors last."""
    expected: tuple[float, ...]
    statistic: float
    """Pearson's chi-square."""
    p: float
    """Share of simulated draws that fit as badly or worse."""


def replay(entries: Iterable[Entry]) -> tuple[RunState, list[Draw]]:
    """Return the state after these events, and every draw of phase two."""
    state = RunState()
    draws: list[Draw] = []
    for entry in entries:
        event = entry.event
        if isinstance(event, StageStarted) and event.stage.round:
            draws.append(_draw(state, event))
        state.apply(entry)
    return state, draws


def fit_of(draws: Sequence[Draw], generator: np.random.Generator) -> DrawTest | None:
    """Return how well these draws fit their sampler; None when none had a choice."""
    free = [one for one in draws if np.count_nonzero(one.probabilities) > 1]
    if not free:
        return None
    by_part = np.stack([_by_part(one) for one in free])
    observed = np.zeros(BINS + 1)
    np.add.at(observed, [_part(one.place, one.history) for one in free], 1)
    expected = by_part.sum(axis=0)
    simulated = np.zeros((SIMULATIONS, BINS + 1))
    rows = np.arange(SIMULATIONS)
    for chances in by_part:
        parts = generator.choice(BINS + 1, SIMULATIONS, p=chances / chances.sum())
        simulated[rows, parts] += 1
    statistic = float(_statistic(observed, expected))
    worse = _statistic(simulated, expected) >= statistic - 1e-9
    return DrawTest(
        draws=len(free),
        observed=tuple(int(count) for count in observed),
        expected=tuple(float(count) for count in expected),
        statistic=statistic,
        p=float((worse.sum() + 1) / (SIMULATIONS + 1)),
    )


def _draw(state: RunState, event: StageStarted) -> Draw:
    stage, cfg = event.stage, state.config
    assert cfg is not None  # the first event brings it
    pool = pool_of(cfg, state, Turn(stage.round, stage.iteration, stage.agent))
    players = (*pool.history, *pool.anchors)
    known = stage.opponent in players
    return Draw(
        round=stage.round,
        iteration=stage.iteration,
        agent=stage.agent,
        place=players.index(stage.opponent) if known else 0,
        history=len(pool.history),
        probabilities=probabilities(cfg.rule, pool),
        is_replayed=known and draw(cfg.rule, pool, state.seed, stage.index) == stage.opponent,
    )


def _part(place: int, history: int) -> int:
    return BINS if place >= history else place * BINS // history


def _by_part(one: Draw) -> NDArray[np.float64]:
    """Return float64[BINS + 1], the probability of each part of the history, and of anchors."""
    sums = np.zeros(BINS + 1)
    for place, probability in enumerate(one.probabilities.tolist()):
        sums[_part(place, one.history)] += probability
    return sums


def _statistic(observed: NDArray[np.float64], expected: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return sum (O - E)^2 / E over the parts that can be drawn at all; float64[...]."""
    possible = expected > 0.0
    differences = observed[..., possible] - expected[possible]
    return (differences**2 / expected[possible]).sum(axis=-1)
