"""How strong the players of a tournament are, with how sure that is.

Two answers. *Bradley-Terry* (1952) puts every player on one scale from who won each bout, and
gives the usual Elo numbers; it cannot see cycles. *Nash averaging* (Balduzzi, Tuyls, Perolat &
Graepel 2018, "Re-evaluating evaluation") looks at the mean scores as a zero-sum game between the
two pools: the mixture nobody can exploit, who is in it, and how much a best response of the other
pool takes from each player.
"""

import dataclasses
import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]
from sklearn.linear_model import LogisticRegression  # pyright: ignore[reportMissingTypeStubs]

from shared.styles.payoff import COVERAGE, Payoff

Floats = NDArray[np.float64]

ELO = 400.0 / math.log(10.0)
"""Elo points in one unit of log odds: 400 points are odds of ten to one."""
RIDGE = 0.1
"""Penalty on half the squared strengths (in log odds): keeps a player that won everything finite
and centres each pool at 0; a hundred bouts outweigh it by far."""
PRIOR = 0.5
"""Wins and losses added to each pairing (Jeffreys): who won 100 of 100 is not known to win all."""
DRAWS = 1000
"""Draws of the win shares for the intervals of ratings."""
NEWTON_STEPS = 60
LONGEST_STEP = 1.0
NEWTON_TOLERANCE = 1e-7
"""Log odds."""
NASH_DRAWS = 200
"""Resampled payoff matrices for the intervals of the equilibrium."""


@dataclasses.dataclass(frozen=True)
class Estimate:
    """A number and its 95 % interval."""

    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class Rating:
    """One player's strength among those of its side: 0 is the pool's mean."""

    player: str
    elo: Estimate
    bouts: int
    win_share: float


@dataclasses.dataclass(frozen=True)
class Ratings:
    """Both pools, strongest first."""

    antagonists: tuple[Rating, ...]
    protagonists: tuple[Rating, ...]
    antagonist_advantage: Estimate
    """Elo points by which a mean antagonist is stronger than a mean protagonist."""


@dataclasses.dataclass(frozen=True)
class NashPlayer:
    """One player in the equilibrium of the payoff matrix."""

    player: str
    weight: Estimate
    """Its share of the mixture nobody can exploit; 0: dominated."""
    exploitability: Estimate
    """Points a bout that the other pool's best response takes from it, from the game's value."""
    best_response: str
    """Who that is."""


@dataclasses.dataclass(frozen=True)
class Nash:
    """The equilibrium between the pools, in the order of the payoff matrix."""

    value: Estimate
    """Points a bout when both sides play their mixtures."""
    antagonists: tuple[NashPlayer, ...]
    protagonists: tuple[NashPlayer, ...]


def ratings_of(payoff: Payoff, generator: np.random.Generator) -> Ratings:
    """Return the Bradley-Terry ratings of the players who have bouts.

    The antagonist wins a bout when its score is above 0. For the intervals the win share of each
    pairing is drawn from its Beta posterior and the model fitted again.

    Args:
        payoff: who won how often.
        generator: draws for the intervals.
    """
    bouts = payoff.bouts
    wins: Floats = payoff.wins + np.float64(PRIOR)
    losses: Floats = bouts - payoff.wins + np.float64(PRIOR)
    played = bouts > 0
    strengths = fit_bradley_terry(wins, losses, played)
    shares = generator.beta(wins, losses, (DRAWS, *wins.shape))
    draws = refit(strengths, wins + losses, shares, played)
    low, high = np.quantile(draws, COVERAGE, axis=0)
    count = len(payoff.antagonists)

    def estimate(k: int) -> Estimate:
        return Estimate(*(ELO * float(number[k]) for number in (strengths, low, high)))

    def pool(
        players: tuple[str, ...], first: int, axis: int, won: NDArray[np.int64]
    ) -> tuple[Rating, ...]:
        found = [
            Rating(player, estimate(first + k), int(n), float(w) / max(1, int(n)))
            for k, (player, n, w) in enumerate(
                zip(players, bouts.sum(axis), won.sum(axis), strict=True)
            )
        ]
        return tuple(sorted(found, key=lambda rating: -rating.elo.value))

    return Ratings(
        antagonists=pool(payoff.antagonists, 0, 1, payoff.wins),
        protagonists=pool(payoff.protagonists, count, 0, bouts - payoff.wins),
        antagonist_advantage=estimate(len(strengths) - 1),
    )


def fit_bradley_terry(wins: Floats, losses: Floats, played: NDArray[np.bool_]) -> Floats:
    """Return float64[A + P + 1]: strengths of both pools and the antagonists' advantage, log odds.

    The odds that antagonist i beats protagonist j are exp(a_i - p_j + advantage).

    Args:
        wins: float64[A, P], of the antagonist; any weights above 0.
        losses: float64[A, P].
        played: bool[A, P], which pairings count.
    """
    players = _design(played)[:, :-1]
    # The intercept is not penalised, so that the ridge centres each pool at 0.
    model: Any = LogisticRegression(C=1.0 / RIDGE, solver="newton-cholesky", tol=1e-8)
    model.fit(
        np.concatenate([players, players]),
        np.repeat([1, 0], len(players)),
        sample_weight=np.concatenate([wins[played], losses[played]]),
    )
    found: Floats = np.append(model.coef_[0], model.intercept_[0])
    return found


def refit(strengths: Floats, total: Floats, shares: Floats, played: NDArray[np.bool_]) -> Floats:
    """Return float64[D, A + P + 1], the same model fitted to D other shares of wins.

    All of them at once, by Newton's method from a fit nearby; a library's fit, one after the
    other, would take a hundred times as long.

    Args:
        strengths: float64[A + P + 1], the fit to begin from.
        total: float64[A, P], weight of each pairing.
        shares: float64[D, A, P], won by the antagonist.
        played: bool[A, P], which pairings count.
    """
    design, weights, won = _design(played), total[played], shares[:, played]
    ridge = np.full(design.shape[1], RIDGE)
    ridge[-1] = 0.0
    found: Floats = np.tile(strengths, (len(shares), 1))
    for _ in range(NEWTON_STEPS):
        expected: Floats = 1.0 / (1.0 + np.exp(-(found @ design.T)))
        slope: Floats = (weights * (expected - won)) @ design + ridge * found
        curvature: Floats = weights * expected * (1.0 - expected)
        hessian: Floats = np.asarray((curvature[:, None, :] * design.T) @ design, np.float64)
        hessian += np.diag(ridge)
        solved = np.linalg.solve(hessian, slope[:, :, None])[:, :, 0]
        step: Floats = np.asarray(solved, np.float64)
        longest: Floats = np.abs(step).max(axis=1, keepdims=True)
        found = found - step / np.maximum(1.0, longest / LONGEST_STEP)
        if longest.max() < NEWTON_TOLERANCE:
            break
    return found


def _design(played: NDArray[np.bool_]) -> Floats:
    """Return float64[K, A + P + 1], a row for each pairing that was played."""
    first, second = np.nonzero(played)
    rows = np.arange(len(first))
    design = np.zeros((len(first), sum(played.shape) + 1))
    design[rows, first] = 1.0
    design[rows, played.shape[0] + second] = -1.0
    design[:, -1] = 1.0
    return design


def nash_of(payoff: Payoff) -> Nash:
    """Return the equilibrium of a complete payoff matrix.

    Raises:
        ValueError: a pairing has no bouts.
    """
    if not payoff.is_complete:
        raise ValueError("every pairing needs bouts; look at Payoff.is_complete first")
    found = solve(payoff.mean)
    draws = [solve(mean) for mean in payoff.resampled[:NASH_DRAWS]]

    def estimate(value: float, values: list[float]) -> Estimate:
        low, high = np.quantile(values, COVERAGE)
        return Estimate(float(value), float(low), float(high))

    def side(players: tuple[str, ...], others: tuple[str, ...], agent: int) -> list[NashPlayer]:
        return [
            NashPlayer(
                player=player,
                weight=estimate(
                    found.mixtures[agent][k], [float(d.mixtures[agent][k]) for d in draws]
                ),
                exploitability=estimate(
                    found.exploitability[agent][k],
                    [float(d.exploitability[agent][k]) for d in draws],
                ),
                best_response=others[int(found.best_responses[agent][k])],
            )
            for k, player in enumerate(players)
        ]

    one, two = payoff.antagonists, payoff.protagonists
    return Nash(
        value=estimate(found.value, [draw.value for draw in draws]),
        antagonists=tuple(side(one, two, 0)),
        protagonists=tuple(side(two, one, 1)),
    )


@dataclasses.dataclass(frozen=True)
class Solution:
    """The equilibrium of a matrix game; each pair has the rows' side first."""

    value: float
    mixtures: tuple[Floats, Floats]
    exploitability: tuple[Floats, Floats]
    best_responses: tuple[NDArray[np.intp], NDArray[np.intp]]


def solve(payoff: Floats) -> Solution:
    """Return an equilibrium of the zero-sum game in which the rows' side gets ``payoff``.

    With measured scores it is the only one, almost surely; copies of one player share their
    weight in one of many ways.

    Args:
        payoff: float64[A, P], finite.
    """
    value, rows = _maximin(payoff)
    _, columns = _maximin(-payoff.T)
    return Solution(
        value=value,
        mixtures=(rows, columns),
        exploitability=(value - payoff.min(axis=1), payoff.max(axis=0) - value),
        best_responses=(payoff.argmin(axis=1), payoff.argmax(axis=0)),
    )


def _maximin(payoff: Floats) -> tuple[float, Floats]:
    """Return the most that the rows' side can be sure of, and the mixture that is sure of it.

    A linear programme: maximise v where no column pays the mixture less than v.
    """
    rows, columns = payoff.shape
    size = float(np.abs(payoff).max()) or 1.0
    costs = np.zeros(rows + 1)
    costs[-1] = -1.0
    result: Any = linprog(
        costs,
        A_ub=np.hstack([-payoff.T / size, np.ones((columns, 1))]),
        b_ub=np.zeros(columns),
        A_eq=np.append(np.ones(rows), 0.0)[None],
        b_eq=[1.0],
        bounds=[(0.0, None)] * rows + [(None, None)],
        method="highs",
    )
    mixture = np.maximum(np.asarray(result.x[:-1], np.float64), 0.0)
    return float(result.x[-1]) * size, mixture / mixture.sum()
