"""Which numbers of a base are far from what the model file says, and how surely."""

from collections.abc import Sequence

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.parameters import INERTIA_PRIOR, BaseParameter, bends
from shared.identification.fitting.space import Space
from shared.identification.gate.certainty import half_widths
from shared.identification.gate.held_out import stretches
from shared.identification.search.begin import doubted_of
from shared.identification.search.searched import Far, Search
from shared.telemetry.wording import listing

FAR = 0.5
"""Of the logarithm of a gain, damping or armature, a factor of 1.65 either way; of the friction
that a model file gives, as a share of it."""
FEW = 2
"""Numbers: more that are far from the file say that it is of another arm."""
_TOLD = 5
"""Parameters that are told as far from the model file."""
_OF_MANY = 1.6
"""Times half of one number's 95 % interval: of thirty numbers one is by so much further off than it
is by chance once in twenty times (Bonferroni)."""
_SHOWN = 5.5
"""Of the cost, that a number must take off to be told: so much one 3.3 standard errors off does."""
_STEPS = 6
"""Derivatives of a fit with a number put back: others make up for it along a valley that bends."""


def far_of(fit: Fit) -> tuple[int, ...]:
    """Return the coordinates of the base that are further from the model file than is likely."""
    return tuple(
        index
        for index, (each, z) in enumerate(zip(fit.space.problem.parameters, fit.z, strict=False))
        if is_of_file(each) and abs(z) > FAR * unit_of(each)
    )


def surely_far(fit: Fit) -> list[int]:
    """Return what is far within its whole interval, as the fit's derivative says, furthest first.

    That is so wide that all of them are in theirs (95 %).
    """
    parameters = fit.space.problem.parameters
    widths = _OF_MANY * half_widths(fit, fit.space.problem.of("train"))
    nearest = {
        index: (abs(float(fit.z[index])) - float(widths[index])) / unit_of(parameters[index])
        for index in far_of(fit)
    }
    return sorted((one for one in nearest if nearest[one] > FAR), key=lambda one: -nearest[one])


def shown_far(found: Search) -> list[int]:
    """Return the same of a search's model, without what can be put back.

    A derivative says that others could not make up for a number where a valley bends: it is put
    back at hardly any cost. Or held-out motion is none the worse for it, and a number is far only
    to make up for something in what was fitted to. Of many, all are put back at once.
    """
    fit = found.current
    if found.far is None or found.far.fit is not fit:
        far = surely_far(fit)
        alone = [[one] for one in far] if len(far) <= FEW else [far]
        losses = found.current_losses
        found.far = Far(
            fit, [one for some in alone if _are_shown(fit, losses, some) for one in some]
        )
    return found.far.numbers


def _are_shown(fit: Fit, losses: Float64, numbers: Sequence[int]) -> bool:
    """Return whether a model is worse with some numbers as its file has them.

    Args:
        fit: of the model.
        losses: float64[S], what it leaves of held-out motion.
        numbers: coordinates of the base.
    """
    problem = fit.space.problem.without(numbers)
    space, least = Space(problem, fit.space.candidates), fit.cost + _SHOWN
    start = np.delete(fit.z, numbers)
    back = polish(space, start, problem.of("train"), _STEPS, wanted=least)
    if back.cost <= least:
        return False
    return float(stretches(problem, back.variant, problem.of("test")).mean()) > float(losses.mean())


def far_from_file(found: Search) -> str:
    """Return in words what of a search's base is surely far from the model file, or nothing."""
    z, parameters = found.current.z, found.problem.parameters
    said = [
        f"{parameters[index].name} {factor_of(parameters[index], float(z[index])):.2g} times"
        for index in shown_far(found)[:_TOLD]
    ]
    return f"the base is far from the model file: {listing(said)} what it says" if said else ""


def bent_beyond_belief(found: Search) -> str:
    """Return in words which links a search's model has further off than is known, or nothing."""
    fit, parameters = found.current, found.problem.parameters
    off = np.abs(bends(parameters, fit.z))
    furthest = sorted(doubted_of(fit), key=lambda index: -off[index])[:_TOLD]
    said = [
        f"{each.name} {each.value(float(fit.z[index])):.3g} {each.unit} for {each.nominal:.3g}"
        for index in furthest
        for each in (parameters[index],)
    ]
    if not said:
        return ""
    return (
        f"links are further from the model file than is believable ({listing(said)}): they make "
        "up for something that is not named, as would torques that are not to scale"
    )


def is_of_file(each: BaseParameter) -> bool:
    """Return whether the model file says how large a number is, and may be far off."""
    return bool(each.nominal) and each.prior != INERTIA_PRIOR


def unit_of(each: BaseParameter) -> float:
    """Return by how much a coordinate moves when its value does so by the nominal one."""
    return 1.0 if each.is_factor else each.nominal / each.scale


def factor_of(each: BaseParameter, z: float) -> float:
    """Return a value over the nominal one."""
    return each.value(z) / each.nominal
