"""Chooses what is hidden: what was asked for, and draws what was not said."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from shared.config.site import nearest
from shared.errors import IdentificationError, SimulationError
from shared.identification.dataset.types import Split
from shared.identification.hidden.recipe import Recipe, Wish
from shared.identification.hidden.recording import Plan
from shared.identification.hidden.sizing import Yardstick
from shared.sim.hidden import spread
from shared.sim.hidden.arms import HiddenArm
from shared.sim.hidden.effect import IN, SHAPE, Case, Hidden, Scene, hidden_effects
from shared.sim.hidden.robot import Robot

_DRAWS: Final = 12
"""Times that an effect is drawn anew which does not show enough."""
_SHOWN: Final = 0.1
"""Of its power in held-out recordings, that an effect has to have in those to fit to."""
EVENTS: Final = ("external_contact", "tracker_slip")
"""They happen in one recording: they are sized on those to fit to."""


@dataclass(frozen=True)
class Factory:
    """Makes robots of one number of a series, with effects in them."""

    recipe: Recipe
    arm: HiddenArm
    own: spread.Spread
    scene: Scene

    def make(self, cases: Sequence[Case]) -> Robot:
        """Return a robot with effects in it."""
        robot = Robot(self.arm.make(), self.recipe.timestep)
        spread.enter(robot, self.own)
        for case in cases:
            hidden_effects()[case.name].enter(robot, case)
        return robot


@dataclass(frozen=True)
class Chosen:
    """An effect that is hidden."""

    hidden: Hidden
    case: Case
    share: float | None
    """Of the residual, that it makes; None where it was not measured."""
    is_shown: bool
    """Whether the recordings to fit to show what was drawn, too: a drive's limit that only held-out
    motion reaches nobody can find."""


def choose(factory: Factory, made: Sequence[Plan], rng: np.random.Generator) -> tuple[Chosen, ...]:
    """Return what is hidden in a robot: what was wished for, then what is drawn.

    Args:
        factory: makes the robots that sizes are tried on.
        made: the recordings.
        rng: what is drawn from.

    Raises:
        IdentificationError: a wish cannot be fulfilled.
    """
    recipe, rulers = factory.recipe, _Rulers(factory, made)
    found = [_fulfilled(factory, rulers, wish, rng) for wish in recipe.wishes]
    for _ in range(recipe.random):
        taken = {each.hidden.name for each in found} | recipe.without
        names = [
            name
            for name, hidden in hidden_effects().items()
            if name not in taken and hidden.places(factory.scene)
        ]
        for _ in range(_DRAWS):
            wish = Wish(names[int(rng.integers(len(names)))])
            drawn = _fulfilled(factory, rulers, wish, rng)
            if _shows(recipe, drawn):
                found.append(drawn)
                break
        else:
            raise IdentificationError(
                f"none of {_DRAWS} effects drawn at random shows enough in this motion; "
                "leave --gentle out, make it longer, or name an effect and its size"
            )
    return tuple(found)


def _shows(recipe: Recipe, chosen: Chosen) -> bool:
    is_much = chosen.share is None or chosen.share >= 0.5 * recipe.shares[0]
    return is_much and chosen.is_shown


def _fulfilled(factory: Factory, rulers: "_Rulers", wish: Wish, rng: np.random.Generator) -> Chosen:
    """Return a wish with place and size; drawn anew while it does not show and may move."""
    found = _drawn(factory, rulers, wish, rng)
    if wish.place is None and wish.size is None:
        for _ in range(_DRAWS):
            if _shows(factory.recipe, found):
                break
            found = _drawn(factory, rulers, wish, rng)
    return found


class _Rulers:
    """Yardsticks for what lasts and for what happens once, made when they are needed."""

    def __init__(self, factory: Factory, made: Sequence[Plan]) -> None:
        self._factory, self._plans = factory, made
        self._made: dict[str, Yardstick] = {}

    def of(self, name: str) -> Yardstick:
        """Return the yardstick for an effect."""
        return self.on("train" if name in EVENTS else "test")

    def on(self, split: Split) -> Yardstick:
        """Return the yardstick on the recordings of a split."""
        if split not in self._made:
            factory = self._factory
            chosen = [plan for plan in self._plans if plan.split == split and not plan.repeats]
            self._made[split] = Yardstick(
                factory.recipe, factory.arm, lambda: factory.make(()), chosen
            )
        return self._made[split]


def _drawn(factory: Factory, rulers: _Rulers, wish: Wish, rng: np.random.Generator) -> Chosen:
    recipe, hidden = factory.recipe, hidden_effects()[wish.name]
    places = _places(hidden, factory.scene)
    place, shape = wish.place, rng.uniform(size=SHAPE)
    if place is None:
        place = places[int(rng.integers(len(places)))]
    if place not in places:
        raise IdentificationError(
            f"{wish.name} cannot be at {place!r} of {recipe.arm}; {nearest(place, places)}"
        )
    low_odds, high_odds = (share / (1.0 - share) for share in recipe.shares)
    power = float(np.exp(rng.uniform(math.log(low_odds), math.log(high_odds))))

    def make(size: float) -> Robot:
        return factory.make([Case(wish.name, factory.scene, place, size, shape)])

    size, share, is_shown = wish.size, None, True
    if size is None:
        low, high = hidden.sizes(factory.scene, place)
        size = rulers.of(wish.name).size_for(power / (1.0 + power), low, high, make)
    if wish.size is None or recipe.has_shares:
        try:
            robot = make(size)
            found = rulers.of(wish.name).power(robot)
            if wish.size is None:
                is_shown = rulers.on("train").raw_power(robot) >= _SHOWN * found
        except SimulationError as error:
            raise IdentificationError(
                f"{wish.name} of size {size:g} is too much: {error}"
            ) from None
        share = found / (1.0 + found)
    return Chosen(hidden, Case(wish.name, factory.scene, place, size, shape), share, is_shown)


def _places(hidden: Hidden, scene: Scene) -> tuple[str, ...]:
    """Return where an effect may be; an event not in the recording that is made twice."""
    places = hidden.places(scene)
    if not places:
        raise IdentificationError(
            f"{hidden.name} cannot be in {scene.arm.name}; leave it out, or choose another --arm"
        )
    if hidden.name not in EVENTS:
        return places
    twice = scene.trajectories[:2]
    found = tuple(
        place
        for place in places
        if (name := place.rsplit(IN, 1)[-1]) in scene.train and name not in twice
    )
    if not found:
        raise IdentificationError(
            f"{hidden.name} needs a second recording to fit to: more --trajectories"
        )
    return found
