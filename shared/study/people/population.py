"""Who the simulated participants are: what is drawn once for each of them.

Every number of a population is an assumption, and a field of the configuration; docs/rehearsal.md
says which have a source. ``specific = 0`` and ``learning = 0`` are the nulls.
"""

import math
from typing import Final

import msgspec
import numpy as np

from shared.config.ranges import check_ranges
from shared.study.people.practice import Law, counting, learned

FEWEST_YEARS: Final = 18
MOST_YEARS: Final = 60


class Population(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Distributions that participants are drawn from (section ``[people]``)."""

    law: Law = "exponential"
    """Of practice."""
    learning: float = 1.0
    """Factor of everybody's rate of learning; 0: nobody learns."""
    games_to_learn: float = 8.0
    """Median over people of the games after which 63 % of what can be learned is learned
    (exponential), or after which half is (power)."""
    rate_spread: float = 0.6
    """Standard deviation of the logarithm of the rate over people."""
    start: float = 0.2
    """Mean share of what can be learned that is there before the first game."""
    start_spread: float = 0.1
    asymptote: float = 0.8
    """Mean share that is there in the end."""
    asymptote_spread: float = 0.12
    specific: float = 0.5
    """Share of what is learned about reading an opponent that is of use against the same opponent
    only; 0: a change of style interrupts nothing."""
    day_spread: float = 0.05
    """Standard deviation of the share from game to game."""
    age: tuple[float, float] = (28.8, 5.6)
    """Mean and standard deviation (years); the paper's."""
    resting: tuple[float, float] = (72.0, 9.0)
    """Heart rate, seated (1/min)."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        check_ranges(
            self,
            ("learning", 0.0, 10.0), ("games_to_learn", 0.1, 1000.0), ("rate_spread", 0.0, 2.0),
            ("start", 0.0, 1.0), ("start_spread", 0.0, 0.5), ("asymptote", 0.0, 1.0),
            ("asymptote_spread", 0.0, 0.5), ("specific", 0.0, 1.0), ("day_spread", 0.0, 0.5),
        )  # fmt: skip

    @property
    def median_rate(self) -> float:
        """Return the median over people of the rate of the law."""
        if self.law == "exponential":
            return 1.0 / self.games_to_learn
        return math.log(2.0) / math.log1p(self.games_to_learn)


class Traits(msgspec.Struct, frozen=True, kw_only=True):
    """One participant, for the whole study."""

    number: int
    """From 1."""
    law: Law
    rate: float
    start: float
    asymptote: float
    specific: float
    day_spread: float
    age: float
    """Years."""
    resting: float
    """Heart rate, seated (1/min)."""
    enthusiasm: float
    """Latent attitude towards the whole, standard normal over people."""
    acquiescence: float
    """How much a person agrees with anything, standard normal."""
    exertion: float
    """How much a game strains this person, share of the heart rate's reserve at full effort."""

    def share(self, games: float, rng: np.random.Generator | None = None) -> float:
        """Return the share of what can be learned that is there after so many games, in [0, 1].

        Args:
            games: that count.
            rng: draws how the day is; None leaves that out.
        """
        gained = learned(self.law, self.rate, games)
        level = self.start + (self.asymptote - self.start) * gained
        if rng is not None:
            level += self.day_spread * rng.standard_normal()
        return min(max(level, 0.0), 1.0)

    def shares(
        self, here: int, everywhere: int, rng: np.random.Generator | None = None
    ) -> tuple[float, float]:
        """Return the shares of both faculties in the next game: the body's, and of reading.

        Args:
            here: games played against this opponent.
            everywhere: games played against anybody.
            rng: draws how the day is.
        """
        count = counting(self.specific, here, everywhere)
        return self.share(everywhere, rng), self.share(count, rng)


def draw(population: Population, number: int, seed: int) -> Traits:
    """Return a participant; the same number and seed are the same person.

    Args:
        population: to draw from.
        number: of the participant, from 1.
        seed: of the study.
    """
    rng = np.random.default_rng([seed, number, 1])
    normal = rng.standard_normal(8)
    start = _share(population.start + population.start_spread * normal[1])
    asymptote = _share(population.asymptote + population.asymptote_spread * normal[2])
    mean, spread = population.age
    rate = population.median_rate * math.exp(population.rate_spread * normal[0])
    return Traits(
        number=number,
        law=population.law,
        rate=population.learning * rate,
        start=start,
        asymptote=max(asymptote, start),
        specific=population.specific,
        day_spread=population.day_spread,
        age=float(np.clip(mean + spread * normal[3], FEWEST_YEARS, MOST_YEARS)),
        resting=float(population.resting[0] + population.resting[1] * np.clip(normal[4], -2, 2)),
        enthusiasm=float(normal[5]),
        acquiescence=float(normal[6]),
        exertion=float(np.clip(0.75 + 0.12 * normal[7], 0.3, 1.0)),
    )


def _share(value: float) -> float:
    return float(np.clip(value, 0.0, 1.0))
