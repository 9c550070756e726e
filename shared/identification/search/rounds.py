"""Searches for causes: looks, tries, and judges each on what was held out."""

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, go_down, polish
from shared.identification.fitting.parameters import bends
from shared.identification.fitting.refit import Rough, settle
from shared.identification.fitting.space import Space
from shared.identification.fitting.turns import LATE
from shared.identification.gate.certainty import SURE, is_there
from shared.identification.gate.held_out import (
    LEAST_SHARE,
    compare,
    floor_of,
    plain_channels,
    stretches,
)
from shared.identification.progress import Progress
from shared.identification.search.events import Usual, explains_event
from shared.identification.search.family import Family, look_elsewhere, relatives
from shared.identification.search.fewer import one_for_many, prune, tell_apart
from shared.identification.search.look import look
from shared.identification.search.outlook import hopeless
from shared.identification.search.screen import Screened
from shared.identification.search.searched import (
    ALIKE,
    NEARLY_NOISE,
    Model,
    Search,
    Tried,
    cosine,
    is_open,
    join,
    judged,
    plain_losses_of,
    so_far,
)

_ROUNDS = 4
"""Each names one cause, and what is like it at other joints."""
_FULL, _FULL_ALIKE = 4, 6
"""Candidates that get a full fit, of those refitted roughly, and the most of which rough refits say
too little to leave one out."""
_SAY_LITTLE = 15.0
"""Of the cost: by so much more than the best one's."""
_FAR_OFF = 10.0
"""Mean square residual, in noise floors, of what was fitted to or held out, from which the base may
be bent out of sight."""
_FAR = 2.0
"""Candidates whose rough refit costs so many times the best one's get no full fit."""
QUIET = 1.25
"""Mean square residual, in noise floors, below which no further cause is looked for."""
_MORE = 1.5
"""Times as much as is foretold: more than that held-out motion seldom follows by chance."""
_AFRESH = 8
"""Derivatives of further fits of what links could make up for."""
_EVENT = 4.0
"""Times the mean square residual of the usual stretch that one counts with at most, between causes:
what happened once would be most of the mean, and most of its error."""
_NEARLY = 0.05
"""Of the cost on what was fitted to: by so much two causes that hardly differ may be apart."""
_FITTED_BETTER, _FITTED_FAR_BETTER = 5.0, 12.5
"""Of the cost: what one more number takes off by chance once in six hundred times, and a number
that is five standard errors off nothing."""
_APART = 0.5
"""Cosine of what two causes explain, up to which three quarters of it are not the same."""
_BENT = 15.0
"""By so much more, as part of the cost, no cause may have links bent than one that does as well."""
_LOADS = {"counterbalance", "torque_bias", "gravity_tilt", "joint_spring"}
"""Causes of which none is told from the others by a few postures: near one of them a load that
depends on posture is a constant torque, whatever numbers either has."""
_OF_MANY = 3.2
"""Standard errors that a cause is off nothing by where noise was not measured: of forty candidates
one is by so much by chance once in twenty times (Bonferroni)."""
_BESIDE = 0.02
"""Of the noise: what is held out must follow a cause beside others by so much, or follow it at all
and surely have so much less left. No law is quite the arm's, and what a named one leaves of what it
did is surely there, too, and looks like others."""
_OF_LINKS = {"payload", "inertia_error"}
"""Causes that may be nothing but links that are other than their file."""
_STANDS_OFF = {
    frozenset({"encoder_offset", "payload"}): ALIKE,
    frozenset({"encoder_offset", "backlash"}): 0.1,
}
"""Pairs that are a joint with another zero, near enough, and the share of the gain within which: a
tool that is heavy beside its middle, of which the shape is not modelled, and a gear with play that
its load never turns round, of which flanks give and links bounce as no model says."""


def search(found: Search, progress: Progress) -> None:
    """Look for causes, one after another, until none passes or one is not told from others."""
    train, test = found.problem.of("train"), found.problem.of("test")
    for _ in range(_ROUNDS):
        is_over = found.accepted and _is_over(found)
        if is_over or not _round(found, train, test, progress):
            break
    if found.accepted:
        tell_apart(found, train, test)
        prune(found, train, test)
    if len(found.accepted) > 1:
        one_for_many(found, train, test)


def _is_over(found: Search) -> bool:
    """Return whether nothing is left that a cause could be named for.

    It is not told from noise or, where that was not measured, all of it is less than what a cause
    must take off to be of use.
    """
    if found.problem.noise.is_measured:
        return _is_quiet(found, so_far(found))
    left, base = float(found.current_losses.mean()), float(found.base_losses.mean())
    return left < LEAST_SHARE * (base - floor_of(base))


def _goes_on(found: Search) -> bool:
    """Return whether so much is left that what is not told apart may be neither."""
    return is_open(found) if found.problem.noise.is_measured else not _is_over(found)


def _is_quiet(found: Search, model: Model) -> bool:
    """Return whether what a model leaves is not told from noise, where that was measured.

    Neither what is new in each block, nor what is slow.
    """
    if not found.problem.noise.is_measured or model.losses.mean() >= QUIET:
        return False
    return bool(plain_losses_of(found.problem, model).mean() < QUIET)


def _round(
    found: Search, train: tuple[int, ...], test: tuple[int, ...], progress: Progress
) -> bool:
    """Look for one more cause; return whether there was one."""
    taken = {each.candidate for each in found.accepted}
    left = [each for each in found.candidates if each not in taken]
    if not left:
        return False
    is_measured = found.problem.noise.is_measured
    now = found.current.variant
    before = plain_channels(found.problem, now, train)
    usual = Usual.of(before, is_one_enough=is_measured and not found.accepted)
    is_off = max(float(found.current_losses.mean()), float(before.mean())) > _FAR_OFF
    is_far = not is_measured or is_off
    off = usual.exceeded(before)
    is_calm = float(off.max()) <= 1.0
    screened, roughly = look(
        found.parts, found.nominal, left, is_far, progress, is_calm, hopeless(found), found.seen
    )
    for each in screened:
        found.screened.setdefault(each.candidate.label, each)
    tried: list[Tried] = []
    for each in _worth_a_fit(roughly, found.current.cost):
        progress("decide", len(tried) / _FULL_ALIKE, each.screened.candidate.label)
        space = Space(found.problem, each.space.candidates)
        fit = settle(space, each.z, train, found.current)
        is_event = explains_event(each.screened.candidate, usual, off, fit, train)
        one = _tried(found, each.screened, fit, is_event)
        tried.append(_begun_anew(found, one, train) if _is_in_a_valley(one) else one)
    for one in tried:
        found.tried.setdefault(one.candidate.label, one)
    useful = [one for one in tried if one.is_event or _is_useful(found, one)]
    useful = _sure(useful, train, is_measured)
    if not useful:
        return False
    best, rivals = _simplest(useful, found.rng)
    rivals = tuple(one for one in rivals if _is_rival(found, best, one, train, test))
    begun = go_down(best.fit, train)  # with the derivative that it has
    fit = polish(best.fit.space, begun.z, train, 4, enough=1e-4)
    final = _tried(found, best.screened, fit, best.is_event)
    if final.gain.loss <= best.gain.loss and (best.is_event or _is_useful(found, final)):
        best = final
    best, rivals, family = _elsewhere(found, best, rivals, train, test, progress)
    found.accepted.append(best)
    found.rivals.append(rivals)
    found.current, found.current_losses = best.fit, best.losses
    if family is not None:
        join(found, family)
    if rivals and not _goes_on(found):
        return False
    if found.parts.space.problem is found.problem:
        found.parts = found.current
    else:
        space = Space(found.parts.space.problem, found.current.space.candidates)
        found.parts = polish(space, found.current.z, space.problem.of("train"), 2)
    return True


def _worth_a_fit(roughly: list[Rough], cost: float) -> list[Rough]:
    """Return which rough refits are followed by a full one.

    Args:
        roughly: best first.
        cost: without any of them.
    """
    best = roughly[0].ratio if roughly else 0.0
    good = [one for one in roughly if one.ratio <= min(1 - 1e-3, _FAR * best + 0.02)]
    more = [one for one in good[_FULL:_FULL_ALIKE] if (one.ratio - best) * cost < _SAY_LITTLE]
    return good[:_FULL] + more


def _is_in_a_valley(one: Tried) -> bool:
    """Return whether a cause's size may be anything, as far as its fit has come.

    Links could make up for it, or there is much more of it held out than what was fitted says.
    """
    is_more = one.foretold is not None and one.foretold.is_seen and one.foretold.share > _MORE
    return one.gain.gain > 0.0 and (not one.is_told or is_more)


def _begun_anew(found: Search, one: Tried, train: tuple[int, ...]) -> Tried:
    """Return a cause that links could make up for, fitted from where it was seen, if better.

    Links and it go together in a valley that is nearly flat, where a rough refit may have left the
    base anywhere. Seen beside a base that has links bent towards it, it is a third of its size; so
    it is fitted from the model file's links, too.
    """
    begins = (found.current.z, found.nominal.with_causes_of(found.current))
    starts = [np.r_[z, one.screened.start] for z in begins]
    fits = [polish(one.fit.space, start, train, _AFRESH) for start in starts]
    fit = min(fits, key=lambda each: each.cost)
    if fit.cost >= one.fit.cost:
        return one
    return _tried(found, one.screened, fit, one.is_event)


def _tried(found: Search, screened: Screened, fit: Fit, is_event: bool) -> Tried:
    """Return a candidate's fit, judged beside what there is so far."""
    losses = stretches(found.problem, fit.variant, found.problem.of("test"))
    gain, fitted, foretold = judged(found, screened.candidate, so_far(found), Model(fit, losses))
    return Tried(screened, fit, gain, losses, is_event, fitted=fitted, foretold=foretold)


def _elsewhere(
    found: Search, best: Tried, rivals: tuple[Tried, ...], train: tuple[int, ...],
    test: tuple[int, ...], progress: Progress,
) -> tuple[Tried, tuple[Tried, ...], Family | None]:  # fmt: skip
    """Look at other joints for the cause to be taken, and for those that are not told from it.

    Returns:
        The cause to take, its rivals, and what is like it at other joints, which may tell it from
        what were its rivals.
    """
    if _is_quiet(found, Model(best.fit, best.losses)):
        return best, rivals, None
    families: list[tuple[Tried, Family]] = []
    for one in (best, *rivals):
        others = relatives(found.candidates, one.candidate, one.fit)
        if not others:
            continue
        progress("refit", 1.0, f"{one.candidate.effect.name} at {len(others)} other joints")
        family = look_elsewhere(one.fit, others, one.losses, train, test, found.rng)
        if family is not None:
            families.append((one, family))
    if not families:
        return best, rivals, None
    taken, family = min(families, key=lambda each: float(each[1].losses.mean()))
    after = {one.candidate: one.losses for one in (best, *rivals)}
    after |= {one.candidate: other.losses for one, other in families}
    left = tuple(
        one
        for one in (best, *rivals)
        if one is not taken
        and compare(after[one.candidate], family.losses, found.rng).surely <= 0.0
    )
    return (best, rivals, None) if left else (taken, (), family)


def _is_useful(found: Search, one: Tried) -> bool:
    """Return whether a cause passes, beside what was named before it if anything was.

    What happened once leaves nothing of what it did elsewhere. Of a payload or a link's inertia
    what is held out cannot tell that, see ``foretold.py``.
    """
    gain = one.gain
    if one.is_of_the_simulation or one.is_of_another_law:
        return False
    if not gain.is_useful(float(found.base_losses.mean())):
        return False
    lasting = [each for each in found.accepted if not each.is_event]
    if not lasting or not found.problem.noise.is_white:
        return True
    if not one.is_told:
        return one.candidate.effect.name in _OF_LINKS
    if gain.apart is None:
        return False
    is_less_left = gain.surely > 0.0 and gain.gain >= _BESIDE * gain.before
    return is_less_left or gain.apart.gain >= _BESIDE * gain.apart.before


def _sure(useful: list[Tried], train: tuple[int, ...], is_measured: bool) -> list[Tried]:
    """Return what is surely more than nothing, or all if nothing is, as of two causes by half.

    A spring of no surely known stiffness, whose rest is far off, is a constant torque. Where no
    repeat says what noise is, there may be causes without end for what is none, so each has to be
    surer than the best of many would be by chance, and none may be.
    """
    least = SURE if is_measured else _OF_MANY
    sure = [one for one in useful if one.is_event or is_there(one.fit, one.candidate, train, least)]
    return sure or (useful if is_measured else [])


def _simplest(useful: list[Tried], rng: np.random.Generator) -> tuple[Tried, tuple[Tried, ...]]:
    """Return the cause to take, and those that are not told from it.

    Each has passed by what was held out; which of them does best, all recordings say. A stretch in
    which something large happened has no more of a say than ``_EVENT`` usual ones. Where hardly
    more than noise is left, it is what the base could not make up for of what was held out; where
    much is, that would be most of what tells one large cause from another. Of what does as well as
    the best one, and has links bent no further for it, the simplest is taken, unless a load is
    surely another one by what was fitted to; what needs more
    numbers to do no better is no rival, unless it is in the nature of both that they are hardly
    told apart.
    """
    is_apart = all(one.gain.apart is not None and one.gain.before < NEARLY_NOISE for one in useful)
    most = _EVENT * min(float(np.median(one.everywhere(is_apart))) for one in useful)
    left = {one.candidate: np.minimum(one.everywhere(is_apart), most) for one in useful}
    best = min(useful, key=lambda one: left[one.candidate].mean())
    alike = [one for one in useful if one is best or _is_alike(best, one, left, rng)]
    bent = {one.candidate: _bent_by(one.fit) for one in alike}
    alike = [one for one in alike if bent[one.candidate] - min(bent.values()) <= _BENT]
    alike = [one for one in alike if not any(_outdoes(each, one, is_apart, rng) for each in alike)]
    fewest = min(one.numbers for one in alike)
    simple = [one for one in alike if one.numbers == fewest]
    taken = min(simple, key=lambda one: left[one.candidate].mean())
    others = [one for one in useful if one is not taken]
    as_simple = {one.candidate for one in simple}
    return taken, tuple(
        one for one in others if one.candidate in as_simple or _is_nearly(taken, one, is_apart, rng)
    )


def _bent_by(fit: Fit) -> float:
    """Return what speaks against the links of a fit's base, as part of the cost."""
    return 0.5 * float(np.sum(bends(fit.space.problem.parameters, fit.z) ** 2))


def _is_nearly(taken: Tried, other: Tried, is_apart: bool, rng: np.random.Generator) -> bool:
    """Return whether another cause hardly differs from what is taken, in nature and in these data.

    Both of the recordings that were fitted to and of those that were held out: these may prefer
    what is taken by what chance does, or surely no more than that (95 %) where the others surely
    prefer what is not.
    """
    name, of_taken = other.candidate.effect.name, taken.candidate.effect.name
    share = _STANDS_OFF.get(frozenset({name, of_taken}), 0.0)
    if not share and LATE.get(name) != of_taken and not {name, of_taken} <= _LOADS:
        return False
    if _outdoes(taken, other, is_apart, rng):
        return False
    margin = compare(other.held(is_apart), taken.held(is_apart), rng)
    is_fitted_better = taken.fit.cost - other.fit.cost > _FITTED_BETTER
    errors = SURE if is_fitted_better else 1.0
    least = max(errors * margin.error, share * taken.gain.gain)
    return margin.gain < least and other.fit.cost <= (1 + _NEARLY) * taken.fit.cost


def _outdoes(better: Tried, other: Tried, is_apart: bool, rng: np.random.Generator) -> bool:
    """Return whether of two loads what was fitted to surely prefers one, and what is held out, too.

    Or that does not say otherwise: a load that depends on posture differs from a constant one by
    little of what either takes off, and by less the less the arm goes about.
    """
    if not {better.candidate.effect.name, other.candidate.effect.name} <= _LOADS:
        return False
    if other.fit.cost - better.fit.cost < _FITTED_FAR_BETTER:
        return False
    margin = compare(better.held(is_apart), other.held(is_apart), rng)
    return margin.gain < margin.error


def _is_alike(
    best: Tried, other: Tried, left: dict[Candidate, Float64], rng: np.random.Generator
) -> bool:
    """Return whether the recordings do not prefer the best surely."""
    margin = compare(left[other.candidate], left[best.candidate], rng)
    return margin.gain < max(margin.error, ALIKE * best.gain.gain)


def _is_rival(
    found: Search, best: Tried, other: Tried, train: tuple[int, ...], test: tuple[int, ...]
) -> bool:
    """Return whether a cause that does as well may stand in the place of the best.

    Not one that explains something else as well, friction of another joint: that is a cause beside
    it, to be found in its turn.
    """
    if other.candidate.effect.name in LATE:
        return True
    return cosine(best, other) > _APART and not _adds(found, best, other, train, test)


def _adds(
    found: Search, best: Tried, other: Tried, train: tuple[int, ...], test: tuple[int, ...]
) -> bool:
    """Return whether a rival is a cause beside the best: together they do surely better.

    Two joints of one chain that both rub: friction of either imitates most of the other's.
    """
    space = best.fit.space.grown(other.candidate)
    size = other.numbers
    starts = [np.r_[best.fit.z, share * other.fit.z[-size:]] for share in (0.5, 0.1)]
    fits = [settle(space, space.clip(start), train) for start in starts]
    fit = min(fits, key=lambda one: one.cost)
    losses = stretches(found.problem, space.variant(fit.z), test)
    return compare(best.losses, losses, found.rng).is_useful(float(found.base_losses.mean()))
