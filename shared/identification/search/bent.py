"""Asks what else the recordings could show where the base alone explains them by going far.

Near one posture a weak servo sags as under a constant torque, so a base whose gains may be anything
explains a torque that nobody then looks for. Between the two lies a valley: at its one end the base
is far from the model file, at the other a cause is large. Where the base went far, the candidates
that explain most of what the file gets wrong are fitted beside a base of which the file is believed
as it usually may be; one that explains as much is no less likely than a base so far off.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shared.identification.arm.places import moving
from shared.identification.conclusion.causes import motion, rival
from shared.identification.conclusion.sentence import label
from shared.identification.dataset.types import Float64
from shared.identification.fitting.base import WINDOW
from shared.identification.fitting.fit import Fit, go_down, polish
from shared.identification.fitting.parameters import BaseParameter, base_parameters
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from shared.identification.gate.certainty import half_widths, is_there
from shared.identification.gate.held_out import compare, stretches
from shared.identification.progress import Progress
from shared.identification.search.far import factor_of, far_of, is_of_file, surely_far, unit_of
from shared.identification.search.screen import Screened, screen
from shared.identification.search.searched import (
    ALIKE,
    EACH_MORE,
    NEARLY_NOISE,
    Otherwise,
    Search,
    Tried,
)
from shared.identification.verdict import Cause, Interval, Tie

NEARBY = 0.2
"""Standard deviation of the same, in a model file that is about right."""
_NEARER = 1.0
"""Of the same as ``FAR``, that a search for a base near the file begins with at most."""
_POSTURE = 0.2
"""Travel that changes the lever of a weight by a fifth at most (rad)."""
_TRIED = 4
"""Candidates that get the chance."""
_MOST = 0.5
"""Of what the best of them explains: what explains less gets none."""
_STEPS, _ENOUGH = 12, 1e-4
"""Of a fit: what pulls a base back is a small part of the cost."""
_SPOILED = 1.2
"""Times what the model file leaves, that a fit which carries over never does."""
_SLIGHT = 15.0
"""What a cause must take off the cost, what speaks against the base included: half a sum of squares
of standard deviations, as one number makes that is 5.5 of them off."""


def otherwise(found: Search, progress: Progress) -> Otherwise | None:
    """Return the causes that explain as much as a base that went far, if there are any.

    None of them is named, not even one that does a little better: a base that went far is at its
    end by itself, and what is left of it says little.

    Args:
        found: a search in which the base alone explains the recordings.
        progress: is told how far it is.
    """
    if not far_of(found.base):
        return None
    progress("base fit", 0.0, "again, near the model file")
    problem = replace(found.problem, parameters=_known(found.problem))
    train, test = problem.of("train"), problem.of("test")
    base = _still_far(found.base, Space(problem))
    if base is None:
        return None
    tried: list[Tried] = []
    instead = _instead(found, base.space)
    for index, each in enumerate(instead):
        progress("refit", index / len(instead), each.candidate.label)
        space = base.space.grown(each.candidate)
        start = np.r_[each.shift, each.start]
        wanted = base.cost - _plainly(space.size - base.space.size)
        fit = polish(space, start, train, _STEPS, _ENOUGH, wanted=wanted)
        losses = stretches(problem, space.variant(fit.z), test)
        is_sure = is_there(fit, each.candidate, train)
        if is_sure and _brings_back(base, fit) and not is_worse(losses, found.base_losses):
            gain = compare(found.base_losses, losses, np.random.default_rng(0))
            one = Tried(each, fit, gain, losses)
            if one.may_be_named:
                tried.append(one)
    if not tried:
        return None
    tried.sort(key=lambda each: each.gain.loss)
    return Otherwise(base, tuple(tried), _alike(base, tried))


def _still_far(base: Fit, space: Space) -> Fit | None:
    """Return a base's fit once the model file is believed more, or None if it is not far then.

    On its way it only comes nearer to the file, so as soon as it is not far it never will be.

    Args:
        base: its fit so far.
        space: of the same parameters, or more, as the file is believed now.
    """
    train = space.problem.of("train")
    fit = _begun(_placed(base, space), train)
    for _ in range(_STEPS):
        found = go_down(fit, train, slight=_ENOUGH)  # a valley bends
        if not _is_far(found):
            return None
        if not found.cost < fit.cost * (1 - _ENOUGH):
            break
        fit = Fit.at(space, found.z, train)
    return fit if _is_far(fit) else None


def _begun(placed: Fit, train: tuple[int, ...]) -> Fit:
    """Return where to begin: the base, or what is furthest off of it a good deal nearer.

    A rotor with a tenth of its inertia is felt no more than one with a twentieth, and the way back
    from there is long.
    """
    space = placed.space
    most = np.array(
        [
            _NEARER * unit_of(each) if is_of_file(each) else np.inf
            for each in space.problem.parameters
        ]
    )
    z = np.clip(placed.z, -most, most)
    if np.array_equal(z, placed.z):
        return placed
    nearer = go_down(Fit.at(space, z, train, is_rough=True), train)
    return Fit.at(space, nearer.z, train) if nearer.cost < placed.cost else placed


def _is_far(base: Fit) -> bool:
    """Return whether a base is far from the model file, by one number surely or by all of them."""
    is_off = _stays(base.space.problem) and _against(base) > _SLIGHT
    return is_off or bool(surely_far(base))


def _stays(problem: Problem) -> bool:
    """Return whether a joint that turns stays where its weight is a constant torque."""
    turning = (place for place in moving(problem.subject) if not place.is_sliding)
    return any(place.travel < _POSTURE for place in turning)


def _instead(found: Search, space: Space) -> list[Screened]:
    """Return the candidates that explain most of what no base near the model file does."""
    parts = Space(space.problem.in_parts(WINDOW))
    pieces = parts.problem.of("train")
    file = Fit.at(parts, np.zeros(space.size), pieces, is_rough=True)
    steady = [each for each in found.candidates if each.recording is None]
    screened = screen(file, steady, pieces)
    return [each for each in screened if each.share > _MOST * screened[0].share][:_TRIED]


def _against(base: Fit) -> float:
    """Return what speaks against a base, as part of the cost: half a sum of squares."""
    return 0.5 * float(np.sum((base.z / base.space.priors) ** 2))


def _brings_back(base: Fit, fit: Fit) -> bool:
    """Return whether less is far from the model file in a fit, and that says something."""
    is_plain = base.cost - fit.cost > _plainly(fit.space.size - base.space.size)
    return is_plain and set(far_of(fit)) < set(far_of(base))


def _plainly(numbers: int) -> float:
    """Return what a cause of so many numbers must take off the cost."""
    return _SLIGHT + EACH_MORE * (numbers - 1)


def is_worse(losses: Float64, than: Float64) -> bool:
    """Return whether the held-out recordings prefer the other one, by more than chance and a bit.

    Where both leave hardly more than noise, one of six that do as well is off by chance alone.
    """
    margin = compare(losses, than, np.random.default_rng(0))
    return margin.gain > max(margin.error, ALIKE * margin.loss)


def _alike(base: Fit, tried: Sequence[Tried]) -> float:
    """Return the smallest cosine between what a base explains by going far, and what causes do."""
    count = len(base.residual) - base.space.size
    file = np.zeros(base.space.size)
    left = base.space.residual([file], base.space.problem.of("train"))[0][:count]
    one = left - base.residual[:count]
    others = [left - each.fit.residual[:count] for each in tried]
    return min(
        float(one @ other / max(np.linalg.norm(one) * np.linalg.norm(other), 1e-12))
        for other in others
    )


def ties_with_base(found: Search) -> tuple[Tie, ...]:
    """Return what the recordings of a search that is over do not tell from a base that went far."""
    if (other := found.otherwise) is None:
        return ()
    loss = float(found.base_losses.mean())
    causes = (_base_cause(other), *(rival(found, each, loss) for each in other.tried))
    record = motion(other.tried[0], other.tried[1:], [label(each) for each in causes])
    return (Tie(causes=causes, alike=other.alike, record=record),)


def _known(problem: Problem) -> tuple[BaseParameter, ...]:
    """Return all of the base's parameters as what a model file that is about right says of them.

    A friction of which it says nothing may be any; links are as well known as ever. What only these
    recordings show (``shown.py``) stays.
    """
    usual = base_parameters(problem.subject)
    names = {each.name for each in usual}
    shown = (each for each in problem.parameters if each.name not in names)
    return tuple(
        replace(each, prior=NEARBY * unit_of(each)) if is_of_file(each) else each
        for each in (*usual, *shown)
    )


def _placed(fit: Fit, space: Space) -> Fit:
    """Return a base's fit, as it is, in another space of the same parameters, or more."""
    names = [each.name for each in fit.space.problem.parameters]
    parameters, train = space.problem.parameters, space.problem.of("train")
    known = dict(zip(names, fit.z, strict=True))
    z = np.array([known.get(each.name, 0.0) for each in parameters], np.float64)
    if [each.name for each in parameters] != names:
        return Fit.at(space, z, train)
    rows = len(fit.residual) - space.size
    residual = np.r_[fit.residual[:rows], z / space.priors]
    return Fit.of(space, z, residual, np.r_[fit.jacobian[:rows], np.diag(1.0 / space.priors)])


def worse_than_file(found: Search) -> str:
    """Return in words that what was fitted does not carry over to what was held out, or nothing.

    Of motion faster, or elsewhere, than what it was fitted to a fit may say less than the file.
    """
    fitted, file = (
        float(np.sqrt(each.mean())) for each in (found.current_losses, found.nominal_losses)
    )
    if fitted < _SPOILED * file or fitted**2 < NEARLY_NOISE:
        return ""
    return (
        f"held out, the fitted model is at {fitted:.3g} and the model file as it is at "
        f"{file:.3g}: what was fitted does not carry over to that motion"
    )


def _base_cause(other: Otherwise) -> Cause:
    """Return what the base does instead of a cause: the parameter that is furthest off for it."""
    base = other.base
    parameters, z = base.space.problem.parameters, base.z
    back = set(far_of(base)) - set(far_of(other.tried[0].fit))
    first, *others = sorted(
        back, key=lambda index: -abs(float(z[index])) / unit_of(parameters[index])
    )
    each, half = parameters[first], half_widths(base, base.space.problem.of("train"))[first]
    low, value, high = (factor_of(each, float(z[first] + off)) for off in (-half, 0.0, half))
    word, _, place = each.name.partition(" ")
    return Cause(
        effect="base model",
        where=place,
        quantity=f"{word} factor",
        value=value,
        unit="",
        interval=Interval(low=low, high=high),
        title="gains, damping, armature or friction are far from the model file's",
        signature="The base fit explains the motion by itself, with numbers far from the file's.",
        others={
            parameters[index].name: factor_of(parameters[index], float(z[index]))
            for index in others
        },
    )
