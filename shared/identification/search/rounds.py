"""Searches for causes: looks, tries, and judges each on what was held out."""

from dataclasses import replace

import numpy as np

from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.long import polish_better
from shared.identification.fitting.refit import Rough, settle
from shared.identification.fitting.space import Space
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
from shared.identification.search.judging import judged
from shared.identification.search.look import look
from shared.identification.search.outlook import hopeless
from shared.identification.search.rivals import as_well, is_rival, loads_alike, simplest
from shared.identification.search.screen import Screened, is_steady
from shared.identification.search.searched import (
    Model,
    Search,
    Tried,
    is_open,
    join,
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
"""Derivatives of further fits of a cause whose size has not settled."""
_OF_MANY = 3.2
"""Standard errors that a cause is off nothing by where noise was not measured: of forty candidates
one is by so much by chance once in twenty times (Bonferroni)."""
_BESIDE = 0.02
"""Of the noise: what is held out must follow a cause beside others by so much, or follow it at all
and surely have so much less left. No law is quite the arm's, and what a named one leaves of what it
did is surely there, too, and looks like others."""
_OF_LINKS = {"payload", "inertia_error"}
"""Causes that may be nothing but links that are other than their file."""


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
    sure = _sure(useful, train, is_measured)
    if not sure:
        return False
    unsure = [one for one in useful if one not in sure and _is_of_links(one)]
    at_best = {one.candidate: _at_best(found, one, train) for one in loads_alike(sure)}
    best, rivals = simplest([at_best.get(one.candidate, one) for one in sure], found.rng)
    rivals += as_well(best, unsure, found.rng)
    rivals = tuple(one for one in rivals if is_rival(found, best, one, train, test))
    if best.candidate not in at_best:
        best = _at_best(found, best, train)
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
    """Return a cause whose size has not settled, fitted from where it was seen, if better.

    Links and it go together in a valley that is nearly flat, where a rough refit may have left the
    base anywhere. Seen beside a base that has links bent towards it, it is a third of its size; so
    it is fitted from the model file's links, too.
    """
    begins = (found.current.z, found.nominal.with_causes_of(found.current))
    starts = [np.r_[z, one.screened.start] for z in begins]
    problem = found.problem
    is_all_over = all(is_steady(problem.subject, each) for each in one.fit.space.candidates)
    parts = found.parts.space.problem if is_all_over else problem
    fit = polish_better(one.fit, parts, starts, train, _AFRESH)
    if fit is one.fit:
        return one
    return _tried(found, one.screened, fit, one.is_event)


def _at_best(found: Search, one: Tried, train: tuple[int, ...]) -> Tried:
    """Return a cause that passes, fitted to the last, if it does no worse then."""
    begun = replace(one.fit, is_rough=True)  # a mended derivative is no better than that
    fit = polish(begun.space, begun, train, 4, enough=1e-4)
    final = _tried(found, one.screened, fit, one.is_event)
    is_better = final.gain.loss <= one.gain.loss and (one.is_event or _is_useful(found, final))
    return final if is_better else one


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
    if not one.may_be_named:
        return False
    if not gain.is_useful(float(found.base_losses.mean())):
        return False
    lasting = [each for each in found.accepted if not each.is_event]
    if not lasting or not found.problem.noise.is_white:
        return True
    if not one.is_told:
        return _is_of_links(one)
    if gain.apart is None:
        return False
    is_less_left = gain.surely > 0.0 and gain.gain >= _BESIDE * gain.before
    return is_less_left or gain.apart.gain >= _BESIDE * gain.apart.before


def _is_of_links(one: Tried) -> bool:
    return one.candidate.effect.name in _OF_LINKS


def _sure(useful: list[Tried], train: tuple[int, ...], is_measured: bool) -> list[Tried]:
    """Return what is surely more than nothing, or all if nothing is, as of two causes by half.

    A spring of no surely known stiffness, whose rest is far off, is a constant torque. Where no
    repeat says what noise is, there may be causes without end for what is none, so each has to be
    surer than the best of many would be by chance, and none may be.
    """
    least = SURE if is_measured else _OF_MANY
    sure = [one for one in useful if one.is_event or is_there(one.fit, one.candidate, train, least)]
    return sure or (useful if is_measured else [])
