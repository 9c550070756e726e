"""Begins with what a model file lacks that knows nothing of drives: friction and rotors.

Most model files of real arms have links and no friction. Where that is as large as their weight,
a base without it has its links bent to where nothing else can be seen any more. So it is fitted
at all joints at once before anything is looked for, from where the torques lead. What is surely
needed there is named like any other cause. So is a load at the tool, where links would have to be
bent further than is believable without it, and a constant torque at a joint that does not show all
of what the file lacks: with as much missing nothing would be seen beside it.
"""

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, descend, go_down, polish
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from shared.identification.fitting.torques import by_torques
from shared.identification.gate.certainty import is_there
from shared.identification.gate.held_out import compare, stretches
from shared.identification.search.family import Family, left_without
from shared.identification.search.screen import Screened

_OF_DRIVES = ("coulomb_friction", "rotor_inertia", "viscous_friction")
"""Effects that sit only where the model file has nothing of the kind."""
_CARRIED = "payload"
_PUSHES = "torque_bias"
_MUCH_BETTER = 15.0
"""By so much less, as part of the cost, more numbers are taken for fewer: a load's, or those of
constant torques."""
_FEWEST = 2
"""Joints: a single one is found like any other cause."""
_MOST = 0.5
"""Share of the joints at which an effect has to be."""
_STEPS = 6
"""Derivatives of a fit."""


def lacking(space: Space, candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Return what a model file lacks of drives; nothing unless commands are torques."""
    if space.problem.subject.control != "torque":
        return ()
    found = [each for each in candidates if each.effect.name in _OF_DRIVES]
    return tuple(found) if len({each.place for each in found}) >= _FEWEST else ()


def loads_of(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Return what the tool may carry, fewest numbers first."""
    return tuple(each for each in candidates if each.effect.name == _CARRIED)


def offsets_of(candidates: Sequence[Candidate]) -> tuple[Candidate, ...]:
    """Return the constant torques that joints may have."""
    return tuple(each for each in candidates if each.effect.name == _PUSHES)


def with_all(problem: Problem, lacks: tuple[Candidate, ...]) -> Fit:
    """Return a fit of all that a file may lack of drives, from where the torques lead."""
    return _fitted(Space(problem, lacks), problem.of("train"))


def with_drives(
    base: Fit,
    lacks: tuple[Candidate, ...],
    rng: np.random.Generator,
    loads: tuple[Candidate, ...] = (),
    offsets: tuple[Candidate, ...] = (),
    together: Fit | None = None,
) -> Family | None:
    """Return what the drives have that the file lacks; None if nothing surely is there.

    Args:
        base: without any cause.
        lacks: what there may be, effect by effect.
        rng: draws.
        loads: of which there may be one, too, fewest numbers first.
        offsets: of which there may be one at each joint that does not show all of what it lacks.
        together: a fit of all that it may lack, if there is one, beside no load.
    """
    if not lacks:
        return None
    problem = base.space.problem
    train, test = problem.of("train"), problem.of("test")
    before = stretches(problem, base.variant, test)
    if loads:
        together = _with_load(problem, lacks, loads)
    elif together is None:
        together = with_all(problem, lacks)
    kept = _needed(together, test, rng)
    odd = {each.place for each in set(lacks) - set(kept)}
    pushed = tuple(each for each in offsets if each.place in odd)
    if kept and pushed:
        space = Space(problem, (*together.space.candidates, *pushed))
        other = _grown(together, space, [np.r_[together.z, np.zeros(len(pushed))]])
        if other.cost < together.cost - _MUCH_BETTER:
            together = polish(space, other.z, train, _STEPS)
            kept = _needed(together, test, rng)
    if not (set(kept) & set(lacks) or problem.noise.is_torque):
        return None  # what the tool carries, or pushes, is found like any other cause
    own = _with_kinds(kept, together, lacks, rng)
    if not set(own) & set(lacks):
        return None
    fit = together
    if len(own) < len(together.space.candidates):
        fit = polish(Space(problem, own), _with_fewer(together, own).z, train, _STEPS)
    after = stretches(problem, fit.variant, test)
    if not compare(before, after, rng).is_sure:
        return None
    gains = {each: compare(left_without(fit, each, test), after, rng) for each in own}
    return Family(fit, after, gains)


def screened_of(fit: Fit, candidate: Candidate) -> Screened:
    """Return a candidate of a fit as if it had been looked at there."""
    own = np.zeros(fit.space.size, np.bool_)
    own[fit.space.where(candidate)] = True
    basis = np.linalg.qr(fit.jacobian[:, ~own]).Q
    moved = fit.jacobian[:, own] @ fit.z[own]
    moved = moved - basis @ (basis.T @ moved)
    power = float(moved @ moved)
    share = power / max(power + float(fit.residual @ fit.residual), 1e-12)
    return Screened(candidate, fit.z[own], np.zeros(fit.space.base_size), share, np.empty(0))


def _fitted(space: Space, train: tuple[int, ...]) -> Fit:
    return polish(space, by_torques(space), train, _STEPS)


def _with_load(problem: Problem, lacks: tuple[Candidate, ...], loads: Sequence[Candidate]) -> Fit:
    """Return a fit of all that a file may lack, and of the load of fewest numbers that is needed.

    It begins with the load that may be any: where there is one, without it nothing comes down.

    Args:
        problem: of which the base may bend.
        lacks: of drives.
        loads: fewest numbers first.
    """
    train = problem.of("train")
    most = _fitted(Space(problem, (*lacks, loads[-1])), train)
    enough = most.cost + _MUCH_BETTER
    alone = _with_fewer(most, lacks)
    if alone.cost <= enough:
        return polish(alone.space, alone.z, train, _STEPS)
    for load in loads[:-1]:
        space = alone.space.grown(load)
        led = by_torques(space)
        other = _grown(alone, space, [led, np.r_[alone.z, led[space.where(load)]]])
        if other.cost <= enough:
            return polish(space, other.z, train, _STEPS)
    return most


def _grown(fit: Fit, space: Space, starts: list[Float64]) -> Fit:
    """Return a fit with more causes than a fit has, by the derivative there; only theirs is new."""
    return descend(space, starts, fit.jacobian, space.problem.of("train"), fit.space.size)


def _with_fewer(fit: Fit, chosen: Sequence[Candidate]) -> Fit:
    """Return a fit with some of a fit's causes, by the derivative there, mended on the way."""
    space, problem = fit.space, fit.space.problem
    own = Space(problem, tuple(each for each in space.candidates if each in chosen))
    columns = [np.arange(space.base_size)]
    columns += [np.arange(space.size)[space.where(each)] for each in own.candidates]
    kept, rows = np.concatenate(columns), len(fit.residual) - space.size
    z, train = fit.z[kept], problem.of("train")
    jacobian = np.r_[fit.jacobian[:rows, kept], np.diag(1.0 / own.priors)]
    return go_down(Fit.of(own, z, own.residual([z], train)[0], jacobian), train)


def _with_kinds(
    kept: tuple[Candidate, ...], together: Fit, lacks: Sequence[Candidate], rng: np.random.Generator
) -> tuple[Candidate, ...]:
    """Return causes with whole kinds of what drives may have, where held-out motion needs them.

    Of little motion friction of either kind and rotors say much the same: none is sure beside the
    others, and without any of them all that they do is left.

    Args:
        kept: what is surely needed.
        together: with all there may be.
        lacks: that, but for loads and pushes.
        rng: draws.
    """
    problem = together.space.problem
    test = problem.of("test")
    fit = _with_fewer(together, kept)
    losses = stretches(problem, fit.variant, test)
    if not compare(losses, stretches(problem, together.variant, test), rng).is_sure:
        return kept
    while left := [each for each in lacks if each not in fit.space.candidates]:
        kinds = [list(group) for _, group in groupby(left, lambda each: each.effect.name)]
        more = [_with_fewer(together, (*fit.space.candidates, *kind)) for kind in kinds]
        best, after = _that_are_there(min(more, key=lambda each: each.cost), rng)
        if not compare(losses, after, rng).is_sure:
            break
        fit, losses = best, after
    return fit.space.candidates


def _that_are_there(fit: Fit, rng: np.random.Generator) -> tuple[Fit, Float64]:
    """Return a fit without causes that may be nothing, unless held-out motion needs them.

    And float64[S], what it leaves of held-out stretches.
    """
    problem = fit.space.problem
    train, test = problem.of("train"), problem.of("test")
    losses = stretches(problem, fit.variant, test)
    there = tuple(each for each in fit.space.candidates if is_there(fit, each, train))
    if len(there) == len(fit.space.candidates):
        return fit, losses
    fewer = _with_fewer(fit, there)
    without = stretches(problem, fewer.variant, test)
    return (fit, losses) if compare(without, losses, rng).is_sure else (fewer, without)


def _needed(fit: Fit, test: tuple[int, ...], rng: np.random.Generator) -> tuple[Candidate, ...]:
    """Return those without which a fit is surely worse, and that are surely more than nothing.

    Of a joint's, what most joints need; at the others it is there, too, if what was fitted to says
    so: an arm of which one joint does not rub makes up for that by a rotor that nothing moves.
    """
    train = fit.space.problem.of("train")
    after: Float64 = stretches(fit.space.problem, fit.variant, test)
    out: list[Candidate] = []
    for name, group in groupby(fit.space.candidates, lambda each: each.effect.name):
        own = list(group)
        there = [each for each in own if is_there(fit, each, train)]
        sure = [
            each for each in there if compare(left_without(fit, each, test), after, rng).is_sure
        ]
        if name in (_CARRIED, _PUSHES):
            out += sure
        elif len(sure) >= max(_FEWEST, _MOST * len(own)):
            out += there
    return tuple(out)
