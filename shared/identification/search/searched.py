"""A search while it goes on: what was looked at and tried, what was taken, and what judges it."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate, Quantity, Side
from shared.identification.fitting.fit import Fit, Start
from shared.identification.fitting.problem import Problem, Variant
from shared.identification.gate.foretold import Foretold, Held
from shared.identification.gate.held_out import Gain, plain_stretches
from shared.identification.search.family import Family
from shared.identification.search.screen import Screened, Seen

ALIKE = 0.02
"""Of a cause's gain: what does as well within this is not told from it."""
EACH_MORE = 4.0
"""Of the cost: what each number of a cause but the first has to take off, too."""
NEARLY_NOISE = 1.4
"""Mean square residual below which nothing worth a name is left."""
BESIDE_A_NAME = 1.7
"""The same beside a cause that passed."""
MAY_BE_LEFT = 0.12
"""Share of the base fit's mean square residual that named causes may leave where that is more:
what is far larger than the noise is never modelled to the last digit. Large play or elasticity of a
PR2 leaves 8 to 11 %; what is named for something that is not looked for, 23 % and more."""
EXACT: tuple[Side, ...] = ("joints", "tracker")
"""Sides of which that holds nothing: what is read wrongly is geometry, so nothing is left of it."""
BESIDE_A_DOUBT = 10.0
"""The most that it may be where the base itself is doubted: more than that may hide anything."""
HARDLY_ANY = 0.002
"""Share of the base fit's that may be left there all the same: nothing only stands in so well. A
drive that gives 73 N m of 186 leaves a 30,000th, and bends links where it is not known."""
STANDS_OUT = 6.0
"""Mean square residual of a stretch over the usual one, where something happened once."""
TAKEN_AWAY = 0.4
"""Share of it that may be left by what explains it."""
_AT_END = 0.02
"""Of the range of a number: so near its end it is there."""


@dataclass(frozen=True)
class Tried:
    """A candidate that was refitted."""

    screened: Screened
    fit: Fit
    gain: Gain
    losses: Float64
    """float64[S] of held-out stretches."""
    is_event: bool = False
    """Whether it happened once, in a recording that was fitted to, and explains what stood out."""
    is_relative: bool = False
    """Whether it was found at a joint because most others have it."""
    fitted: Float64 = field(default_factory=lambda: np.empty(0))
    """float64[R] of stretches of what was fitted to, with sizes in which they have no say."""
    foretold: Foretold | None = None
    """How what was held out follows it, where that was asked."""

    @property
    def candidate(self) -> Candidate:
        """Return which."""
        return self.screened.candidate

    @property
    def is_told(self) -> bool:
        """Return whether what was held out could tell it from links and the base."""
        return self.foretold is None or self.foretold.is_told

    def held(self, is_apart: bool = False) -> Float64:
        """Return float64[S], what it leaves of what was held out.

        Args:
            is_apart: without what the base could make up for there.
        """
        return self.foretold.after if is_apart and self.foretold is not None else self.losses

    def everywhere(self, is_apart: bool = False) -> Float64:
        """Return float64[S + R], what it leaves of all recordings."""
        return np.concatenate([self.held(is_apart), self.fitted])

    @property
    def numbers(self) -> int:
        """Return how many numbers the effect has."""
        return len(self.screened.start)

    @property
    def is_of_the_simulation(self) -> bool:
        """Return whether it is so small that the simulation is off by as much itself."""
        return any(abs(value) < each.least for value, each in self._numbers)

    @property
    def is_of_another_law(self) -> bool:
        """Return whether a number that says how is where the law is no longer this one."""
        return any(is_at_end(value, each) for value, each in self._numbers)

    @property
    def may_be_named(self) -> bool:
        """Return whether its sizes are of this law, and of an arm."""
        return not (self.is_of_the_simulation or self.is_of_another_law)

    @property
    def _numbers(self) -> list[tuple[float, Quantity]]:
        """Return its sizes as they were fitted, each with what it is."""
        subject, place = self.fit.space.problem.subject, self.candidate.place
        values = self.fit.space.values(self.fit.z)[-1]
        return list(zip(values, self.candidate.effect.quantities(subject, place), strict=True))


def is_at_end(value: float, quantity: Quantity) -> bool:
    """Return whether a number that says how is where the law is no longer this one."""
    near = _AT_END * (quantity.high - quantity.low)
    is_low = quantity.ends[0] and value <= quantity.low + near
    return is_low or (quantity.ends[1] and value >= quantity.high - near)


def cosine(one: Tried, other: Tried) -> float:
    """Return how much of what two causes explain is the same, without what the base could."""
    first, second = one.screened.signature, other.screened.signature
    if first.size == 0 or second.size == 0:
        return 0.0
    return abs(float(first @ second))


@dataclass(frozen=True)
class Otherwise:
    """Causes that do as well as the base alone, beside a base near the model file (``bent.py``)."""

    base: Fit
    """Far from the model file, though what is known of that counts."""
    tried: tuple[Tried, ...]
    """Best first."""
    alike: float
    """Smallest cosine between what the base explains by going far, and what they explain."""


class Far(NamedTuple):
    """Numbers of a base that are surely far from the model file (``far.py``)."""

    fit: Fit
    """Of which."""
    numbers: list[int]
    """Their places, furthest first."""


class ByAll(NamedTuple):
    """Mean square residuals of a model fitted to all recordings, in noise floors.

    Of those that were fitted to before or of the others, whichever is more.
    """

    new: float
    """Of what is new in each block."""
    plain: float
    """As they are."""


class Left(NamedTuple):
    """Mean square residuals of what nothing was fitted to, in noise floors."""

    nominal: float
    base: float
    to_explain: float
    """What the base leaves, or one that may bend more if that is less, see ``Search.freer``."""
    current: float
    by_all: float | None

    @property
    def least(self) -> float:
        """Return what the current model leaves, or does once it is fitted to all recordings."""
        return self.current if self.by_all is None else min(self.current, self.by_all)


@dataclass
class Search:
    """A search while it goes on, and what it found."""

    problem: Problem
    rng: np.random.Generator
    candidates: tuple[Candidate, ...]
    ruled_out: dict[str, str]
    doubted: tuple[str, ...]
    """Parameters that were taken out of the base because they went further than is believable."""
    base: Fit
    """Without any cause, on whole recordings."""
    nominal: Start
    """Where refits begin a second time."""
    parts: Fit
    """With what was accepted, on short parts: where is looked."""
    current: Fit
    """The same on whole recordings: where is judged."""
    nominal_losses: Float64
    base_losses: Float64
    current_losses: Float64
    seen: Seen = field(default_factory=Seen)
    """How candidates changed the residual in the first round."""
    screened: dict[str, Screened] = field(default_factory=dict[str, Screened])
    """Every candidate's best, from the first round."""
    tried: dict[str, Tried] = field(default_factory=dict[str, Tried])
    accepted: list[Tried] = field(default_factory=list[Tried])
    rivals: list[tuple[Tried, ...]] = field(default_factory=list[tuple[Tried, ...]])
    """For each accepted cause, what the data do not tell from it."""
    otherwise: Otherwise | None = None
    """Where nothing was accepted, what does as well as the base alone."""
    final: Fit | None = None
    """The current model fitted to all recordings, for sizes; nothing is judged by it."""
    fitted_to: tuple[int, ...] = ()
    """Segments of the final fit."""
    held: Held | None = None
    """Held-out recordings, as they were last looked at."""
    far: Far | None = None
    """What of a model's base is surely far from the file, as it was last asked."""
    by_all: ByAll | None = None
    """What the current model leaves once it is fitted to all recordings; None where it was not
    asked."""
    freer: "Model | None" = None
    """A base that may be wrong where this search's is as the model file has it, if there is one:
    more than that leaves is nothing to be explained."""
    only_like: str = ""
    """Why what was accepted only stands in for a law that is not known, see ``likeness.py``;
    nothing if it does not."""

    @property
    def base_parts(self) -> Fit:
        """Return the base's fit on short parts, or on whole recordings once causes are in those.

        They are there from the begin only under torque control, where all parts are short; and
        they stay there when all that was accepted is taken back.
        """
        return self.base if self.parts.space.candidates else self.parts

    @property
    def left(self) -> Left:
        """Return how much is left of what is new in each block: there small causes show."""
        nominal, base, current = (
            float(each.mean())
            for each in (self.nominal_losses, self.base_losses, self.current_losses)
        )
        freer = base if self.freer is None else float(self.freer.losses.mean())
        by_all = None if self.by_all is None else self.by_all.new
        return Left(nominal, base, min(base, freer), current, by_all)

    @property
    def plainly(self) -> Left:
        """Return how much is left as it is: what is slow and wrong shows in that."""
        nominal, base, current = (float(each.mean()) for each in plain_losses(self))
        freer = base
        if self.freer is not None:
            own = self.freer.fit.space.problem
            freer = float(plain_losses_of(own, self.freer).mean())
        by_all = None if self.by_all is None else self.by_all.plain
        return Left(nominal, base, min(base, freer), current, by_all)

    @property
    def told(self) -> Fit:
        """Return the fit that sizes are told from."""
        return self.current if self.final is None else self.final


def join(found: Search, family: Family) -> None:
    """Take what was found at several joints at once."""
    for candidate, gain in family.gains.items():
        screened = found.screened[candidate.label]
        found.accepted.append(Tried(screened, family.fit, gain, family.losses, is_relative=True))
        found.tried[candidate.label] = found.accepted[-1]
        found.rivals.append(())
    found.current, found.current_losses = family.fit, family.losses


def is_open(found: Search) -> bool:
    """Return whether more is left than a verdict that names causes, or none, may leave.

    Links far from what is known of them say that the base is of another kind than the arm: what
    takes much off then may be anything, so it has to take off nearly all. So may what only mends
    what a base fit had spoiled, of motion unlike what it was fitted to. What goes once the model
    may go by all recordings is only what those to fit to did not show of it.
    """
    return _is_much(found, found.left) or _is_much(found, found.plainly)


def why_open(found: Search) -> str:
    """Return why what was accepted is not believed, for people; nothing if it may be.

    Numbers are root mean squares, in noise floors.
    """
    if not found.accepted:
        return ""
    if _is_much(found, left := found.left):
        return _why_much(found, left, is_told=True)
    if _is_much(found, left := found.plainly):
        return _why_much(found, left, is_told=False)
    return ""


def _why_much(found: Search, left: Left, is_told: bool) -> str:
    if left.current >= left.nominal:
        return f"and the model file as it is {left.nominal**0.5:.2f}"
    if is_told and left.current >= left.base:
        return "which is no less"
    limit = f"too much to believe it ({_most(found, left) ** 0.5:.2f} at most)"
    if is_told:
        return f"which is {limit}"
    lies = f"{left.least**0.5:.2f} of {left.base**0.5:.2f}"
    return f"and of how far readings are off, slow drift and all, {lies}: {limit}"


def _is_much(found: Search, left: Left) -> bool:
    if found.accepted and left.current >= left.nominal:
        return True
    return left.least > _most(found, left)


def _most(found: Search, left: Left) -> float:
    """Return what may be left, mean square."""
    if not found.accepted:
        return NEARLY_NOISE
    is_exact = all(one.candidate.effect.side in EXACT for one in found.accepted)
    share = 0.0 if is_exact else MAY_BE_LEFT * left.to_explain
    if found.doubted:
        share = min(share, max(BESIDE_A_DOUBT, HARDLY_ANY * left.base))
    return max(BESIDE_A_NAME, share)


def plain_losses(found: Search) -> tuple[Float64, Float64, Float64]:
    """Return float64[S] of held-out stretches of the nominal model, the base and the current one.

    Of plain residuals; those of the search where nothing is known of what noise carries on, and
    where nothing holds the arm: what a part is off by at its end is what its start was off by, one
    number a part, so that of a right model half as much again may be left or half as much.
    """
    nothing = Variant(np.zeros(len(found.problem.parameters)))
    base, current = Model(found.base, found.base_losses), so_far(found)
    return (
        _plain(found.problem, nothing, found.nominal_losses),
        plain_losses_of(found.problem, base),
        plain_losses_of(found.problem, current),
    )


def plain_losses_of(problem: Problem, model: "Model") -> Float64:
    """Return float64[S] of one model's, the same."""
    return _plain(problem, model.fit.variant, model.losses)


def _plain(problem: Problem, variant: Variant, losses: Float64) -> Float64:
    if problem.noise.memory is None or problem.noise.is_adrift:
        return losses
    return plain_stretches(problem, variant, problem.of("test"))


class Model(NamedTuple):
    """A fit, and what it leaves of what nothing was fitted to."""

    fit: Fit
    losses: Float64
    """float64[S] of held-out stretches."""


def so_far(found: Search) -> Model:
    """Return what there is so far."""
    return Model(found.current, found.current_losses)
