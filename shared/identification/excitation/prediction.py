"""What recordings will show: how far each effect stands out of the noise, and what looks alike.

Each effect is put into the nominal arm at a size that matters to it, the recordings are simulated,
and what the base parameters could absorb is taken out of the difference. What is left, in standard
deviations of the noise floor and over all training recordings, is its signal-to-noise ratio. It is
seen where that is a tenth of all that is left then, noise and effect, which is from where on
nine of ten are named; two effects whose differences point the same way cannot be told apart.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.subject import Subject, subject_of
from shared.identification.dataset.types import Dataset, Float64
from shared.identification.effect import Candidate, Effect
from shared.identification.excitation.arm import TIMESTEP
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import Problem, Variant
from shared.identification.fitting.space import Space
from shared.identification.noise.floor import Noise
from shared.identification.verdict import NAMED_RATIO
from shared.sim.plant.plant import pr2
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal

ALIKE: Final = 0.9
"""Cosine from which two effects are confused."""
_CAPACITY: Final = 160
_FULL: Final = 0.9
"""Of a joint's torque limit: what an able recording takes of it."""
_FAST: Final = 1.0
"""Speed of an able recording (rad/s, m/s)."""
_WIDE: Final = 0.5
"""Travel of an able recording (rad, m)."""
_SMALL: Final = 0.5
"""Of its probe on an able recording: the size at which a smooth effect is looked at."""

# What a recording has on top of what the arm did where no repeat says so: means over 20 ms of
# 0.3 mrad encoders and of a tracker of 0.9 mm and 2 mrad, neighbours correlated.
_ENCODER: Final = 0.3e-3
_TRACKER: Final = (0.9e-3, 0.9e-3, 0.9e-3, 2.0e-3, 2.0e-3, 2.0e-3)
_CORRELATION: Final = 0.6


@dataclass(frozen=True)
class Power:
    """How well one effect at one place is seen."""

    effect: str
    place: str
    quantity: str
    """Its first number."""
    size: float
    """At which it was looked at, of that."""
    unit: str
    ratio: float
    """Signal to noise, of its best seen number (1)."""
    named_from: float
    """Size of that from which on it is named nine times of ten, if it shows by its
    size; infinite if that does not show at all."""
    is_visible: bool
    """Whether it stands out: at the size looked at any of its numbers is named."""

    @property
    def label(self) -> str:
        """Return effect and place."""
        return f"{self.effect} {self.place}".strip()


@dataclass(frozen=True)
class Outlook:
    """How well an effect is seen, at all places that it could have on this arm."""

    effect: str
    title: str
    powers: tuple[Power, ...]
    """Worst first; empty if the arm cannot have it."""

    @property
    def is_visible(self) -> bool:
        """Whether it stands out at most of its places."""
        return 2 * sum(power.is_visible for power in self.powers) > len(self.powers)


@dataclass(frozen=True)
class Pair:
    """Two effects that look alike."""

    first: Power
    second: Power
    cosine: float
    """Of the angle between what they do to the recordings, 0 to 1."""


@dataclass(frozen=True)
class Prediction:
    """What recordings will show."""

    outlooks: tuple[Outlook, ...]
    """Of every effect of the catalogue, in its order."""
    pairs: tuple[Pair, ...]
    """Visible ones that are confused, most alike first."""

    @property
    def share(self) -> float:
        """Return the share of effects that this arm could have and that would be seen."""
        able = [outlook for outlook in self.outlooks if outlook.powers]
        return sum(outlook.is_visible for outlook in able) / max(len(able), 1)


def assumed_noise(joints: int) -> Noise:
    """Return the noise floor of recordings that nobody has made yet."""
    return Noise(
        joints=np.full(joints, _ENCODER),
        tracker=np.array(_TRACKER),
        correlation=np.full(joints + 6, _CORRELATION),
        is_measured=False,
    )


def able_subject(dataset: Dataset) -> Subject:
    """Return the arm of recordings as if they moved every joint far, fast and with full torque.

    So that the sizes that effects are looked at with are those that matter to the arm, not those
    that these recordings happen to show; a PR2 takes coarser steps.
    """
    subject = subject_of(dataset, capacity=1)
    plant = subject.plant
    if dataset.source.kind == "pr2":
        plant = pr2(dataset.source.arm, dataset.source.parameters, TIMESTEP)
    nominal = Rollouts(plant, (), _CAPACITY)
    model = nominal.model
    joints = np.array([int(model.joint(plant.mj_joint(name)).id) for name in plant.labels])
    is_limited = np.array(model.jnt_actfrclimited, bool)[joints]
    limits = _FULL * np.array(model.jnt_actfrcrange, np.float64)[joints, 1]
    return replace(
        subject,
        plant=plant,
        nominal=nominal,
        travel=np.maximum(subject.travel, _WIDE),
        speed=np.maximum(subject.speed, _FAST),
        drive=np.where(is_limited, limits, subject.drive),
    )


def predict(dataset: Dataset, noise: Noise, effects: Sequence[Effect]) -> Prediction:
    """Return what recordings will show of effects.

    Args:
        dataset: recordings; of a programme, simulated on the nominal arm.
        noise: their floor.
        effects: the catalogue.
    """
    # A repeat only makes the noise known, and what is held out only judges.
    kept = replace(dataset, trajectories=dataset.train)
    subject = able_subject(kept)
    problem = Problem(subject, kept, base_parameters(subject), noise)
    space = Space(problem)
    segments = problem.of("train")
    zero = np.zeros(space.size)
    candidates = [
        Candidate(effect, place)
        for effect in effects
        for place in _thinned(effect.places(subject), len(subject.joints))
    ]
    variants, owners = _probes(subject, space.variant(zero), candidates)
    steps = np.where(space.steps > space.bounds[1], -space.steps, space.steps)
    moved = [space.variant(step) for step in np.diag(steps)]
    found = _simulated(problem, [space.variant(zero), *moved, *variants], segments)
    n = space.size
    jacobian = (found[1 : n + 1] - found[0]).T / steps
    jacobian = np.concatenate([jacobian, np.diag(1.0 / space.priors)])
    basis = np.linalg.qr(jacobian)[0]
    changes = (found[n + 1 :] - found[0]).T
    changes = np.concatenate([changes, np.zeros((n, changes.shape[1]))])
    bare = changes - basis @ (basis.T @ changes)
    # Neighbouring blocks that are correlated count for less.
    rho = float(np.mean(noise.correlation))
    ratios = np.linalg.norm(bare, axis=0) * np.sqrt((1.0 - rho) / (1.0 + rho))
    # Of as much noise as there are numbers, as correlated as what is seen.
    noise_ratio = np.sqrt(found.shape[1] * (1.0 - rho) / (1.0 + rho))
    wanted = float(noise_ratio * NAMED_RATIO)
    powers = [
        _power(subject, candidate, [ratios[column] for column, owner in enumerate(owners)
                                    if owner == index], wanted)
        for index, candidate in enumerate(candidates)
    ]  # fmt: skip
    outlooks = tuple(
        Outlook(
            effect.name,
            effect.title,
            tuple(sorted((power for power in powers if power.effect == effect.name),
                         key=lambda power: power.ratio)),
        )
        for effect in effects
    )  # fmt: skip
    return Prediction(outlooks, _pairs(powers, owners, bare))


def _thinned(places: tuple[str, ...], most: int) -> tuple[str, ...]:
    """Return at most so many places, spread over all: a push may be at any joint at any time."""
    step = 1 if len(places) <= most else len(places) // most + 1
    return places[::step]


def _looks(subject: Subject, candidate: Candidate) -> list[Float64]:
    """Return float64[Q], sizes at which an effect is looked at: each number that says how much.

    Numbers that say how are in the middle of where they are looked for. The numbers of an effect
    that is not smooth mean nothing alone, so they go together.
    """
    quantities = candidate.effect.quantities(subject, candidate.place)
    probes = np.array([each.probe for each in quantities])
    form = np.array([each.grid[len(each.grid) // 2] if each.grid else 0.0 for each in quantities])
    sizes = [index for index, each in enumerate(quantities) if not each.grid]
    if not sizes:
        return [probes]
    if not all(quantities[index].is_smooth for index in sizes):
        return [np.where([bool(each.grid) for each in quantities], form, probes)]
    out: list[Float64] = []
    for index in sizes:
        values = form.copy()
        values[index] = _SMALL * probes[index]
        out.append(values)
    return out


def _power(subject: Subject, candidate: Candidate, ratios: Sequence[float], wanted: float) -> Power:
    """Return how well a candidate is seen.

    Args:
        subject: the arm.
        candidate: the effect at its place.
        ratios: signal to noise of each of its numbers.
        wanted: signal to noise from which on it is named.
    """
    quantities = candidate.effect.quantities(subject, candidate.place)
    first = quantities[0]
    size, own = float(_looks(subject, candidate)[0][0]), float(ratios[0])
    return Power(
        effect=candidate.effect.name,
        place=candidate.place,
        quantity=first.name,
        size=size,
        unit=first.unit,
        ratio=float(max(ratios)),
        named_from=_named_from(size, own / wanted, is_level=all(each.grid for each in quantities)),
        is_visible=float(max(ratios)) >= wanted,
    )


def _named_from(size: float, share: float, *, is_level: bool) -> float:
    """Return the size from which on an effect is named.

    Args:
        size: at which it was looked at.
        share: of what it takes to be named, which it shows at that size.
        is_level: whether it acts from some size on: of others nothing is known.
    """
    if is_level:
        return size if share >= 1.0 else np.inf
    return size / share if share > 0.0 else np.inf


def _probes(
    subject: Subject, base: Variant, candidates: Sequence[Candidate]
) -> tuple[list[Variant], list[int]]:
    """Return the base with each candidate at its sizes, and whose they are."""
    variants: list[Variant] = []
    owners: list[int] = []
    for index, candidate in enumerate(candidates):
        for values in _looks(subject, candidate):
            variants.append(base.with_extra(candidate, values))
            owners.append(index)
    return variants, owners


def _simulated(problem: Problem, variants: Sequence[Variant], segments: tuple[int, ...]) -> Float64:
    """Return float64[V, M], the residuals of each variant.

    Arms with a torque law are stepped one by one, so those go together and the others go ahead.
    """
    has_law = [_has_law(problem, variant) for variant in variants]
    order: NDArray[np.int64] = np.argsort(np.array(has_law), kind="stable")
    split = int(len(variants) - np.sum(has_law))
    parts: list[Float64] = []
    for segment in segments:
        halves = [
            problem.vector([variants[int(index)] for index in indices], (segment,))
            for indices in (order[:split], order[split:])
            if len(indices)
        ]
        parts.append(np.concatenate(halves)[np.argsort(order)])
    return np.concatenate(parts, axis=1)


def _has_law(problem: Problem, variant: Variant) -> bool:
    seen: list[bool] = []

    def look(row: Row) -> None:
        for candidate, values in variant.extras:
            if not candidate.effect.structure(problem.subject, candidate.place):
                candidate.effect.enter(row, candidate.place, values)
        seen.append(bool(row.laws or row.frictions))

    recorded = problem.segments[0].recorded
    instant = Recorded(
        initial_q=recorded.initial_q,
        initial_qd=recorded.initial_qd,
        command=Signal(recorded.command.at[:2], recorded.command.values[:2]),
        logged_q=recorded.logged_q,
        joints_at=recorded.joints_at[:2],
        tracker_at=None,
        trajectory=recorded.trajectory,
    )
    problem.subject.nominal.run([(look, instant)])
    return seen[0]


def _pairs(powers: Sequence[Power], owners: Sequence[int], bare: Float64) -> tuple[Pair, ...]:
    """Return the visible candidates of which some numbers do the same."""
    size = np.linalg.norm(bare, axis=0)
    unit = bare / np.maximum(size, 1e-12)
    cosines = np.abs(unit.T @ unit)
    best: dict[tuple[int, int], float] = {}
    for row, column in np.argwhere(np.triu(cosines, 1) > ALIKE):
        key = owners[int(row)], owners[int(column)]
        if key[0] != key[1] and powers[key[0]].is_visible and powers[key[1]].is_visible:
            best[key] = max(best.get(key, 0.0), float(cosines[row, column]))
    found = [Pair(powers[first], powers[second], cos) for (first, second), cos in best.items()]
    return tuple(sorted(found, key=lambda pair: -pair.cosine))
