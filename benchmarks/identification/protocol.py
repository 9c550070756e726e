"""Which data sets are made: every effect by itself, none, two, one that is not looked for, ties.

Seeds begin at 20 000; those below 10 000 are for development. What the finder was mended by is no
test of it: then a further series asks the same of other data sets.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal, get_args

from shared.identification.hidden.recipe import Recipe, Wish
from shared.sim.hidden.arms import ARMS, ArmName
from shared.sim.hidden.effect import Scene, hidden_effects

FIRST_SEED = 20_000
SERIES_SEEDS = 20_000
"""Between the first seeds of two series."""
PER_EFFECT = 20
NULLS = 100
PAIRS = 60
OUTSIDE = 40
TIES = 20
Cell = Literal["single", "null", "null_imperfect", "two", "outside", "tie"]
CELLS: Final[tuple[str, ...]] = get_args(Cell)
_ARMS: tuple[ArmName, ...] = ("pr2", "arm3")
"""By turns; effects that neither can have go to ``torque2``."""
_LATER: Final = (
    "setpoint_ramp", "integral_action", "velocity_feedforward", "command_filter",
    "setpoint_speed", "dead_band",
)  # fmt: skip
"""Effects that the protocol began without: their trials are numbered after all others."""


@dataclass(frozen=True)
class Trial:
    """One data set, and what the finder may not look for."""

    cell: Cell
    recipe: Recipe
    without: frozenset[str] = frozenset()
    is_later: bool = False
    """Whether it came to the protocol when a part of that was done: the order of that stays."""

    @property
    def key(self) -> str:
        """Return its name, the same in every run."""
        names = "+".join(wish.name for wish in self.recipe.wishes) or str(self.recipe.random)
        return f"{self.cell}/{names}/{self.recipe.arm}/{self.recipe.seed}"


def protocol(share: float = 1.0, series: int = 1) -> tuple[Trial, ...]:
    """Return the trials of all cells, those of a cell by turns.

    Args:
        share: of the numbers in the protocol; at least one of each.
        series: which, from 1 on; each has seeds of its own, else they are alike.
    """
    first = FIRST_SEED + SERIES_SEEDS * (series - 1)

    def some(count: int) -> int:
        return max(1, round(share * count))

    found = [
        *_single(some(PER_EFFECT), first),
        *_nulls("null", some(NULLS), first + 10_000, is_imperfect=False),
        *_nulls("null_imperfect", some(NULLS), first + 11_000, is_imperfect=True),
        *_two(some(PAIRS), first + 12_000),
        *_outside(some(OUTSIDE), first + 13_000),
        *_ties(some(TIES), first + 14_000),
    ]
    return tuple(found)


def smoke() -> tuple[Trial, ...]:
    """Return a hidden effect and none, in recordings as short as can be."""
    small = {"arm": "torque2", "seconds": 2.5, "train": 2, "test": 1}
    return (
        Trial("single", Recipe(**small, seed=FIRST_SEED, wishes=(Wish("payload", None, 0.3),))),
        Trial("null", Recipe(**small, seed=FIRST_SEED + 1)),
    )


def arms_of(name: str) -> tuple[ArmName, ...]:
    """Return the arms that an effect is hidden in."""
    able = tuple(arm for arm in ARMS if hidden_effects()[name].places(_scene(arm)))
    return tuple(arm for arm in _ARMS if arm in able) or able


def _first() -> tuple[str, ...]:
    """Return what could be hidden when the protocol began, in the order of the seeds."""
    return tuple(name for name in hidden_effects() if name not in _LATER)


def _scene(arm: ArmName) -> Scene:
    return Scene(ARMS[arm], ("a", "a_again", "b"), ("a", "a_again", "b"), 6.0)


def _single(count: int, first: int) -> Iterator[Trial]:
    for number, name in enumerate((*_first(), *_LATER)):
        arms = arms_of(name)
        for turn in range(count):
            seed = first + 100 * number + turn
            recipe = Recipe(arm=arms[turn % len(arms)], seed=seed, wishes=(Wish(name),))
            yield Trial("single", recipe, is_later=name in _LATER)


def _nulls(cell: Cell, count: int, first: int, *, is_imperfect: bool) -> Iterator[Trial]:
    for turn in range(count):
        arm = _ARMS[turn % len(_ARMS)]
        yield Trial(cell, Recipe(arm=arm, seed=first + turn, is_imperfect=is_imperfect))


def _two(count: int, first: int) -> Iterator[Trial]:
    for turn in range(count):
        arm = _ARMS[turn % len(_ARMS)]
        recipe = Recipe(arm=arm, seed=first + turn, random=2, shares=(0.3, 0.95))
        yield Trial("two", recipe)


def _outside(count: int, first: int) -> Iterator[Trial]:
    names = _first()
    for turn in range(count):
        name = names[turn % len(names)]
        arms = arms_of(name)
        arm = arms[turn // len(names) % len(arms)]
        seed = first + turn
        recipe = Recipe(arm=arm, seed=seed, wishes=(Wish(name),), shares=(0.5, 0.95))
        yield Trial("outside", recipe, frozenset({name}))


def _ties(count: int, first: int) -> Iterator[Trial]:
    """Return two causes near one posture, where they are the same torque, as is a servo's gain.

    Of the shoulder, which carries weight, and just as far as shows a torque at all (0.05 rad). Half
    of its 6 N m more or less is a gain off by as much as a model file may be; these are larger.
    """
    for turn in range(count):
        name, most = (("torque_bias", 6.0), ("counterbalance", 1.0))[turn % 2]
        size = most * (0.7 + 0.3 * turn / count)
        recipe = Recipe(
            arm="arm3", seed=first + turn, reach=0.08,
            wishes=(Wish(name, "shoulder", size),),
        )  # fmt: skip
        yield Trial("tie", recipe)
