"""How many people a difference of learning between two conditions needs, by simulation.

People's own slopes of score on game number are compared within people, by the paired t-test that
the analysis uses. What varies is taken from a study that was played: the scatter of games about a
person's own line (resampled as it is), and the spread over people of the difference of their
slopes beyond what that scatter gives.
"""

# pyright: basic
# (scipy's types are partial)

import dataclasses
from collections.abc import Sequence
from typing import Final

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from shared.errors import StudyError
from shared.study.analysis.finding import ALPHA, Estimate
from shared.study.analysis.intervals import TAIL, share_estimate
from shared.study.analysis.regression import person_slopes

Floats = NDArray[np.float64]

FEWEST_PEOPLE: Final = 3
WANTED: Final = 0.8
"""Power that studies are planned for."""
RESAMPLED: Final = 200
"""Bootstrap draws of people, for what their number leaves open."""
_CHUNK: Final = 4_000_000
"""Scores drawn at a time."""


@dataclasses.dataclass(frozen=True)
class Components:
    """What varies in a study of two conditions."""

    games: Floats
    """float64[k], game numbers of a section."""
    residuals: Floats
    """float64[2, m], points: games of each condition about their person's line, as wide as the
    games' own scatter."""
    slope_spread: float
    """Over people, of the difference of slopes (points a game), without the games' scatter."""

    @property
    def weights(self) -> Floats:
        """Return float64[k], what a score adds to the slope of its section."""
        centred = self.games - self.games.mean()
        return centred / (centred**2).sum()

    @property
    def spread(self) -> float:
        """Return the standard deviation over people of a measured difference of slopes."""
        of_games = float(self.residuals.var(axis=1).sum()) * float((self.weights**2).sum())
        return float(np.sqrt(self.slope_spread**2 + of_games))


class Power(msgspec.Struct, frozen=True, kw_only=True):
    """How often an effect of a study of so many people is found."""

    people: int
    power: Estimate
    """Of the simulation; its interval is that of the number of draws."""


class Planned(msgspec.Struct, frozen=True, kw_only=True):
    """What it takes to find an effect."""

    effect: float
    """Difference of slopes (points a game)."""
    slope_spread: float
    """Between people (points a game)."""
    residual_sd: float
    """Of a game, root of the mean over both conditions (points)."""
    people: int
    """Of the study that this is taken from."""
    curve: tuple[Power, ...]
    needed: int | None
    """Fewest people of the curve with a power of ``WANTED``; None where none has it."""
    needed_low: int | None
    needed_high: int | None
    """The same at the ends of a 95 % interval over who took part (bootstrap of people); None is
    more than the curve's most."""


def components_of(games: Floats, first: Floats, second: Floats) -> Components:
    """Return what varied in a study.

    Args:
        games: float64[k], game numbers.
        first: float64[n, k], scores in one condition, finite.
        second: float64[n, k], of the same people in the other one.

    Raises:
        StudyError: people or games are too few.
    """
    n, k = first.shape
    if n < FEWEST_PEOPLE or k < 3:
        raise StudyError(
            f"{n} people with {k} games in both conditions are too few to say how people differ: "
            f"at least {FEWEST_PEOPLE} with 3 games are needed"
        )
    lines = np.stack([_about_lines(games, first).ravel(), _about_lines(games, second).ravel()])
    residuals = lines * np.sqrt(k / (k - 2.0))
    difference = person_slopes(games, first) - person_slopes(games, second)
    of_games = residuals.var(axis=1).sum() / ((games - games.mean()) ** 2).sum()
    between = max(float(difference.var(ddof=1) - of_games), 0.0)
    return Components(games, residuals, float(np.sqrt(between)))


def found(
    components: Components, effect: float, people: int, draws: int, rng: np.random.Generator
) -> int:
    """Return in how many of so many simulated studies the effect is significant.

    Args:
        components: what varies.
        effect: difference of slopes (points a game).
        people: of each study.
        draws: how many studies.
        rng: draws them.
    """
    k = len(components.games)
    limit = float(stats.t.ppf(1.0 - ALPHA / 2.0, people - 1))
    count, left = 0, draws
    while left > 0:
        size = min(left, max(_CHUNK // (2 * people * k), 1))
        one, two = (
            rng.choice(games, (size, people, k)) @ components.weights
            for games in components.residuals
        )
        own = components.slope_spread * rng.standard_normal((size, people))
        difference = effect + own + one - two
        error = difference.std(axis=1, ddof=1) / np.sqrt(people)
        t = difference.mean(axis=1) / np.maximum(error, 1e-12)
        count += int(np.count_nonzero(np.abs(t) > limit))
        left -= size
    return count


def plan(
    games: Floats, first: Floats, second: Floats, effect: float, people: Sequence[int], draws: int,
    rng: np.random.Generator,
) -> Planned:  # fmt: skip
    """Return how many people the effect needs.

    Args:
        games: float64[k], game numbers.
        first: float64[n, k], scores in one condition, finite.
        second: float64[n, k], of the same people in the other one.
        effect: difference of slopes to be found (points a game).
        people: numbers of people to try, rising, each at least 2.
        draws: simulated studies for each of them.
        rng: draws them.

    Raises:
        StudyError: people or games are too few.
    """
    components = components_of(games, first, second)
    curve = tuple(
        Power(
            people=number,
            power=share_estimate(found(components, effect, number, draws, rng), draws, "power"),
        )
        for number in people
    )
    n = len(first)
    needs: list[float] = []
    for _ in range(RESAMPLED):
        who = rng.integers(n, size=n)
        needs.append(_needed(components_of(games, first[who], second[who]), effect, people))
    low, high = np.quantile(needs, (TAIL, 1.0 - TAIL), method="nearest")
    wanted = [each.people for each in curve if each.power.value >= WANTED]
    return Planned(
        effect=effect,
        slope_spread=components.slope_spread,
        residual_sd=float(np.sqrt(components.residuals.var(axis=1).mean())),
        people=n,
        curve=curve,
        needed=wanted[0] if wanted else None,
        needed_low=int(low) if np.isfinite(low) else None,
        needed_high=int(high) if np.isfinite(high) else None,
    )


def _needed(components: Components, effect: float, people: Sequence[int]) -> float:
    """Return the fewest people with the power that is wanted, by the noncentral t; or infinity."""
    n = np.asarray(people, np.float64)
    limit = stats.t.ppf(1.0 - ALPHA / 2.0, n - 1.0)
    away = abs(effect) * np.sqrt(n) / max(components.spread, 1e-12)
    reached = stats.nct.sf(limit, n - 1.0, away) >= WANTED
    reached |= away > 30.0  # where the noncentral t has no digits left, the power is 1
    return float(n[reached][0]) if reached.any() else np.inf


def _about_lines(games: Floats, scores: Floats) -> Floats:
    """Return float64[n, k], scores less each person's own line."""
    slopes = person_slopes(games, scores)
    centred = scores - scores.mean(axis=1, keepdims=True)
    return centred - slopes[:, None] * (games - games.mean())
