"""What is taken of several causes that pass, and a search as a whole."""

import copy
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from shared.identification.catalogue.backlash import EFFECT as PLAY
from shared.identification.catalogue.command_latency import EFFECT as LATE
from shared.identification.catalogue.counterbalance import EFFECT as BALANCE
from shared.identification.catalogue.encoder_offset import EFFECT as ZERO
from shared.identification.catalogue.gravity_tilt import EFFECT as TILT
from shared.identification.catalogue.joint_spring import EFFECT as SPRING
from shared.identification.catalogue.payload import EFFECT as PAYLOAD
from shared.identification.catalogue.payload import OFF_CENTRE
from shared.identification.catalogue.sample_and_hold import EFFECT as TURNS
from shared.identification.catalogue.stribeck_friction import EFFECT as STICKS
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.catalogue.torque_gain import EFFECT as GAIN
from shared.identification.dataset.types import Dataset, Float64
from shared.identification.effect import Candidate, Effect
from shared.identification.find import identify
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.refit import Rough
from shared.identification.gate.certainty import SURE, sureness
from shared.identification.gate.foretold import Foretold
from shared.identification.gate.held_out import Taken
from shared.identification.hidden.generator import hide
from shared.identification.hidden.recipe import Recipe, wish_of
from shared.identification.progress import silent
from shared.identification.search.rivals import as_well, is_rival, loads_alike, simplest
from shared.identification.search.rounds import (
    _begun_anew,  # pyright: ignore[reportPrivateUsage]
    _is_in_a_valley,  # pyright: ignore[reportPrivateUsage]
    _is_useful,  # pyright: ignore[reportPrivateUsage]
    _sure,  # pyright: ignore[reportPrivateUsage]
    _worth_a_fit,  # pyright: ignore[reportPrivateUsage]
    search,
)
from shared.identification.search.searched import Tried
from shared.identification.verdict import Verdict
from tests.searches import DRAG, ELBOW, LIFT, Searches

_LOAD, _TILT = Candidate(PAYLOAD, ""), Candidate(TILT, "")
_BAD = np.linspace(8.0, 12.0, 8)
_GOOD = np.linspace(1.0, 1.2, 8)


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    return Searches(tmp_path_factory.mktemp("data"))


@pytest.mark.parametrize(
    ("ratios", "kept"),
    [
        ((0.5, 0.6, 0.7, 0.8, 0.9), 4),  # the first is far better than the fifth
        ((0.5, 0.6, 1.1), 2),
        ((0.1, 0.15, 0.9), 2),
        ((0.990, 0.991, 0.992, 0.993, 0.9935, 0.9945, 0.9946), 6),  # none is told from the first
        ((0.990, 0.991, 0.992, 0.993, 0.994, 0.9953), 5),  # 15.9 more of a cost of 3000
        ((), 0),
    ],
)
def test_rough_refits_that_say_little_leave_fewer_candidates_out(
    searches: Searches, ratios: tuple[float, ...], kept: int
):
    one = searches.tried(ELBOW, _BAD, _GOOD)
    roughly = [Rough(one.screened, one.fit.space, one.fit.z, ratio) for ratio in ratios]
    cost = 3000.0
    assert _worth_a_fit(roughly, cost) == roughly[:kept]


def _fitted_as_well(one: Tried, other: Tried, less: float = 0.0) -> Tried:
    """Return one as if what was fitted to preferred it by so much of the cost."""
    return replace(one, fit=replace(one.fit, cost=other.fit.cost - less))


def test_of_causes_that_do_as_well_the_one_of_fewer_numbers_is_taken(searches: Searches):
    simple = searches.tried(ELBOW, _BAD, _GOOD + 0.01)
    best = _fitted_as_well(searches.tried(DRAG, _BAD, _GOOD, numbers=3), simple)
    taken, rivals = simplest([best, simple], np.random.default_rng(0))
    assert taken is simple
    assert rivals == ()


@pytest.mark.parametrize(
    ("less", "worse", "is_taken"),
    [(18.0, 0.0, True), (15.0, 0.0, False), (18.0, 0.035, False)],
)
def test_one_of_more_numbers_is_taken_if_what_was_fitted_to_is_sure_of_it(
    searches: Searches, less: float, worse: float, is_taken: bool
):
    simple = searches.tried(ELBOW, _BAD, _GOOD)
    about = worse + np.tile([-0.06, 0.06], 4)  # held out it does 1.6 standard errors worse
    more = searches.tried(DRAG, _BAD, _GOOD + about, numbers=3)
    more = _fitted_as_well(more, simple, less)
    taken, rivals = simplest([more, simple], np.random.default_rng(0))
    assert taken is (more if is_taken else simple)
    assert rivals == ()


def test_a_payload_that_may_be_of_any_size_is_a_rival_if_all_recordings_say_no_more(
    searches: Searches,
):
    taken = searches.tried(ELBOW, _BAD, _GOOD, numbers=2)
    load = _fitted_as_well(searches.tried(_LOAD, _BAD, _GOOD + 0.01), taken)
    rng = np.random.default_rng(0)
    assert as_well(taken, [load], rng) == (load,)
    further = _fitted_as_well(searches.tried(_LOAD, _BAD, _GOOD + 1.0), taken)
    assert as_well(taken, [further], rng) == ()
    assert as_well(taken, [_fitted_as_well(load, taken, -20.0)], rng) == ()
    more = _fitted_as_well(searches.tried(_LOAD, _BAD, _GOOD, numbers=3), taken)
    assert as_well(taken, [more], rng) == ()


def test_loads_that_are_nearly_alike_are_fitted_to_the_last(searches: Searches):
    constant, balance = (searches.tried(each, _BAD, _GOOD) for each in (LIFT, _TILT))
    friction = searches.tried(DRAG, _BAD, _GOOD)
    near = _fitted_as_well(balance, constant, -0.04 * constant.fit.cost)
    assert loads_alike([constant, friction, near]) == [constant, near]
    far = _fitted_as_well(balance, constant, -0.06 * constant.fit.cost)
    assert loads_alike([constant, friction, far]) == []
    assert loads_alike([friction]) == []


@pytest.mark.parametrize(("bend", "is_taken"), [(0.2, True), (0.6, False)])
def test_what_does_as_well_by_bending_links_further_is_not_taken_however_simple(
    searches: Searches, bend: float, is_taken: bool
):
    simple = searches.tried(ELBOW, _BAD, _GOOD)
    best = _fitted_as_well(searches.tried(DRAG, _BAD, _GOOD, numbers=3), simple)
    names = [each.name for each in searches.problem.parameters]
    z = simple.fit.z.copy()
    z[names.index("mass elbow")] = bend  # 2 or 6 standard deviations: 2 or 18 of the cost
    bent = replace(simple, fit=replace(simple.fit, z=z))
    taken, _ = simplest([best, bent], np.random.default_rng(0))
    assert taken is (bent if is_taken else best)


def test_causes_of_as_many_numbers_that_do_as_well_are_rivals(searches: Searches):
    one = searches.tried(ELBOW, _BAD, _GOOD + 0.01)
    other = searches.tried(LIFT, _BAD, _GOOD)
    taken, rivals = simplest([one, other], np.random.default_rng(0))
    assert taken is other
    assert rivals == (one,)


def test_a_cause_that_does_surely_worse_is_no_rival_however_simple(searches: Searches):
    best = searches.tried(DRAG, _BAD, _GOOD, numbers=3)
    worse = searches.tried(ELBOW, _BAD, _GOOD + 2.0)
    taken, rivals = simplest([worse, best], np.random.default_rng(0))
    assert taken is best
    assert rivals == ()


def test_which_cause_does_best_is_judged_by_all_recordings(searches: Searches):
    """Of more numbers, one does a little better held out; where it was fitted to it does not."""
    rng = np.random.default_rng(0)
    little, fitted = 0.02 + 0.005 * rng.normal(size=8), 1.0 + 0.1 * rng.normal(size=24)
    simple = searches.tried(ELBOW, _BAD, _GOOD + little * 10.0)
    much = _fitted_as_well(searches.tried(DRAG, _BAD, _GOOD, numbers=3), simple)
    assert simplest([much, simple], rng)[0] is much
    more = fitted + 0.2 + 0.2 * rng.normal(size=24)
    both = replace(much, fitted=more), replace(simple, fitted=fitted)
    assert simplest(list(both), rng)[0] is both[1]


def test_what_happened_once_has_no_large_say_in_which_cause_does_best(searches: Searches):
    rng = np.random.default_rng(0)
    fitted = 1.0 + 0.1 * rng.normal(size=24)
    event = np.where(np.arange(24) == 7, 90.0, 0.0)
    right = replace(searches.tried(ELBOW, _BAD, _GOOD), fitted=fitted + event)
    wrong = replace(searches.tried(LIFT, _BAD, _GOOD + 0.3), fitted=fitted + 0.2 + 0.8 * event)
    assert wrong.everywhere().mean() < right.everywhere().mean()
    assert simplest([wrong, right], rng) == (right, ())


def test_what_links_could_make_up_for_is_fitted_anew_from_where_it_was_seen(searches: Searches):
    found, train = searches.search(np.full(4, 10.0)), searches.problem.of("train")
    one = searches.tried(ELBOW, _BAD, _GOOD)
    astray = one.fit.z + 0.3
    stuck = replace(one, fit=Fit.at(one.fit.space, one.fit.space.clip(astray), train))
    anew = _begun_anew(found, stuck, train)
    assert anew.fit.cost < 0.7 * stuck.fit.cost
    assert _begun_anew(found, anew, train) is anew


@pytest.mark.parametrize(
    ("foretold", "gain", "is_in_one"),
    [
        (None, 1.0, False),
        (Foretold(0.5, 0.4, kept=0.05), 1.0, True),  # links make up for nearly all of it
        (Foretold(0.5, 0.4, kept=0.05), -1.0, False),
        (Foretold(2.5, 2.6, kept=0.3), 1.0, True),  # much more of it is there
        (Foretold(2.5, 1.2, kept=0.3), 1.0, False),
        (Foretold(0.9, 2.6, kept=0.3), 1.0, False),  # or it is by chance
    ],
)
def test_a_size_is_not_settled_where_links_make_up_for_it_or_much_more_of_it_is_held_out(
    searches: Searches, foretold: Foretold | None, gain: float, is_in_one: bool
):
    one = searches.tried(ELBOW, _BAD, _BAD - gain)
    assert _is_in_a_valley(replace(one, foretold=foretold)) is is_in_one


def test_what_links_could_make_up_for_is_fitted_from_the_model_file_too(searches: Searches):
    found, train = searches.search(np.full(4, 10.0)), searches.problem.of("train")
    one = searches.tried(ELBOW, _BAD, _GOOD)
    bent = searches.base.space.clip(searches.base.z + 50.0)
    found.current = Fit.at(searches.base.space, bent, train)
    alone = polish(one.fit.space, np.r_[bent, one.screened.start], train, 8)
    anew = _begun_anew(found, replace(one, fit=alone), train)
    assert anew.fit.cost < 0.5 * alone.cost


def test_a_cause_that_may_as_well_be_nothing_is_taken_only_if_all_may(searches: Searches):
    train = searches.problem.of("train")

    def sized(times: float) -> Tried:
        one = searches.tried(ELBOW, _BAD, _GOOD + 0.5)
        z = one.fit.z.copy()
        z[one.fit.space.where(ELBOW)] *= times
        return replace(one, fit=replace(one.fit, z=z))

    there, nothing = sized(1e6), sized(1e-6)
    event = replace(nothing, is_event=True)
    for useful, sure in (
        ([nothing, there], [there]),
        ([nothing], [nothing]),
        ([event, there], [event, there]),
    ):
        found = _sure(useful, train, True)
        assert len(found) == len(sure)
        assert all(one is other for one, other in zip(found, sure, strict=True))


def test_where_noise_was_not_measured_what_may_as_well_be_nothing_is_never_taken(
    searches: Searches,
):
    one = searches.tried(ELBOW, _BAD, _GOOD + 0.5)
    own, train = one.fit.space.where(ELBOW), searches.problem.of("train")

    def sized(errors: float) -> Tried:
        z = one.fit.z.copy()
        z[own] *= errors / sureness(one.fit, ELBOW, train)
        return replace(one, fit=replace(one.fit, z=z))

    unsure, sure = sized(4.0), sized(20.0)
    assert SURE < sureness(unsure.fit, ELBOW, train) < 3.0
    assert not _sure([unsure], train, False)
    (kept,) = _sure([unsure, sure], train, False)
    assert kept is sure


@pytest.mark.parametrize(
    ("candidate", "takes", "kept", "surely", "beside"),
    [
        (ELBOW, 0.05, 0.5, -0.1, True),
        (ELBOW, 0.01, 0.5, -0.1, False),
        (ELBOW, 0.01, 0.5, 0.1, True),
        (ELBOW, None, 0.5, 0.1, False),
        (_LOAD, 0.01, 0.05, 0.1, True),
        (ELBOW, 0.01, 0.05, 0.1, False),
    ],
    ids=[
        "plain", "slight", "slight, and surely less is left", "not followed",
        "a link's, which cannot show there", "what the base can do there",
    ],
)  # fmt: skip
def test_beside_a_cause_held_out_motion_must_follow_another_plainly(
    searches: Searches, candidate: Candidate, takes: float | None, kept: float, surely: float,
    beside: bool,
):  # fmt: skip
    first = searches.tried(DRAG, _BAD, _GOOD + 2.0)
    other = searches.tried(candidate, _GOOD + 2.0, _GOOD)
    apart = None if takes is None else Taken(1.0, takes)
    gain = replace(other.gain, is_measured=True, apart=apart)
    other = replace(other, gain=gain, foretold=Foretold(9.0, 0.9, kept))
    alone, after, once = (
        searches.search(_BAD),
        searches.search(_BAD, first),
        searches.search(_BAD, replace(first, is_event=True)),
    )
    for found in (alone, after, once):
        found.problem = copy.copy(found.problem)
        found.problem.noise = replace(found.problem.noise, is_measured=True, memory=np.eye(1))
    assert _is_useful(alone, other)
    assert _is_useful(once, other)  # what happened once leaves nothing elsewhere
    other = replace(other, gain=replace(gain, surely=surely))
    assert _is_useful(after, other) is beside
    after.problem.noise = replace(after.problem.noise, memory=None)
    assert _is_useful(after, replace(other, gain=gain))  # nobody knows what is new in noise


@pytest.mark.parametrize(("of_step", "is_useful"), [(0.4, False), (0.6, True)])
def test_a_delay_of_less_than_half_a_step_is_the_simulations(
    searches: Searches, of_step: float, is_useful: bool
):
    one = searches.tried(Candidate(LATE, ""), _BAD, _GOOD)
    z = one.fit.z.copy()
    z[-1] = of_step * searches.problem.subject.plant.timestep / 0.01  # of the delay's probe
    one = replace(one, fit=replace(one.fit, z=z))
    assert _is_useful(searches.search(_BAD), one) is is_useful


@pytest.mark.parametrize(
    ("effect", "at", "is_useful"),
    [
        (STICKS, 0.0, True),
        (STICKS, 0.9, True),
        (STICKS, 1.0, False),  # what falls off over half of all speeds is dry friction
        (SPRING, 0.0, False),  # what rests that far off pulls alike everywhere
        (SPRING, 0.5, True),
        (SPRING, 0.99, False),
    ],
)
def test_a_law_whose_form_is_at_its_end_is_another_one(
    searches: Searches, effect: Effect, at: float, is_useful: bool
):
    one = searches.tried(Candidate(effect, "elbow"), _BAD, _GOOD, numbers=2)
    z, (low, high) = one.fit.z.copy(), one.fit.space.bounds
    z[-1] = low[-1] + at * (high[-1] - low[-1])
    one = replace(one, fit=replace(one.fit, z=z))
    assert _is_useful(searches.search(_BAD), one) is is_useful


def test_turns_so_short_that_they_are_a_delay_are_a_rival_of_it(searches: Searches):
    late = searches.tried(Candidate(LATE, ""), _BAD, _GOOD)
    about = 0.01 + np.tile([-0.06, 0.06], 4)  # better in one stretch, worse in the next
    turns = searches.tried(Candidate(TURNS, ""), _BAD, _GOOD + about, numbers=2)
    other = searches.tried(DRAG, _BAD, _GOOD + 0.01, numbers=2)
    turns, other = (_fitted_as_well(each, late) for each in (turns, other))
    taken, rivals = simplest([turns, late, other], np.random.default_rng(0))
    assert taken is late
    assert rivals == (turns,)


def test_a_counterbalance_and_a_constant_torque_are_rivals_unless_one_does_surely_better(
    searches: Searches,
):
    torque = searches.tried(ELBOW, _BAD, _GOOD)
    about = 0.01 + np.tile([-0.06, 0.06], 4)
    balance = searches.tried(Candidate(BALANCE, "elbow"), _BAD, _GOOD + about, numbers=2)
    balance = replace(balance, fit=replace(balance.fit, cost=torque.fit.cost))
    assert simplest([balance, torque], np.random.default_rng(0)) == (torque, (balance,))
    surely = replace(balance, losses=_GOOD + 0.05)
    assert simplest([surely, torque], np.random.default_rng(0)) == (torque, ())
    better = replace(torque, fitted=_GOOD + 2.0), replace(balance, fitted=_GOOD)
    taken, rivals = simplest(list(better), np.random.default_rng(0))
    assert taken is better[1]
    assert [one.candidate for one in rivals] == [ELBOW]


@pytest.mark.parametrize(
    ("worse", "less", "named", "is_tie"),
    [
        (0.0, 3.0, "torque_bias", True),
        (0.0, 11.0, "counterbalance", False),  # 4.7 standard errors
        (0.015, 11.0, "torque_bias", True),  # 4.7, and 0.7 held out that say otherwise
        (0.0, 14.0, "counterbalance", False),
        (0.035, 14.0, "torque_bias", True),  # held out it does 1.6 standard errors worse
        (0.035, 3.0, "torque_bias", False),
        (0.06, 14.0, "torque_bias", False),
    ],
)
def test_what_was_fitted_to_has_a_say_in_which_of_two_loads_it_is(
    searches: Searches, worse: float, less: float, named: str, is_tie: bool
):
    torque = searches.tried(ELBOW, _BAD, _GOOD)
    about = worse + np.tile([-0.06, 0.06], 4)
    balance = searches.tried(Candidate(BALANCE, "elbow"), _BAD, _GOOD + about, numbers=2)
    balance = replace(balance, fit=replace(balance.fit, cost=torque.fit.cost - less))
    taken, rivals = simplest([balance, torque], np.random.default_rng(0))
    assert taken.candidate.effect.name == named
    assert bool(rivals) is is_tie


def test_a_tilt_that_is_not_told_from_a_torque_is_its_rival_though_it_has_more_numbers(
    searches: Searches,
):
    torque = searches.tried(ELBOW, _BAD, _GOOD)
    about = 0.01 + np.tile([-0.06, 0.06], 4)
    tilt = searches.tried(Candidate(TILT, ""), _BAD, _GOOD + about, numbers=2)
    tilt = replace(tilt, fit=replace(tilt.fit, cost=torque.fit.cost))
    assert simplest([tilt, torque], np.random.default_rng(0)) == (torque, (tilt,))
    surely = replace(tilt, losses=_GOOD + 0.05)
    assert simplest([surely, torque], np.random.default_rng(0)) == (torque, ())


def test_a_payload_beside_the_centre_and_an_encoders_zero_are_rivals_if_a_little_apart(
    searches: Searches,
):
    zero = searches.tried(Candidate(ZERO, "elbow"), _BAD, _GOOD)
    apart = 0.01 * float((_BAD - _GOOD).mean())
    heavy = searches.tried(Candidate(PAYLOAD, OFF_CENTRE), _BAD, _GOOD + apart, numbers=5)
    heavy = replace(heavy, fit=replace(heavy.fit, cost=zero.fit.cost))
    assert simplest([heavy, zero], np.random.default_rng(0)) == (zero, (heavy,))
    further = replace(heavy, losses=_GOOD + 5.0 * apart)
    assert simplest([further, zero], np.random.default_rng(0)) == (zero, ())


@pytest.mark.parametrize(("apart", "are_rivals"), [(0.07, True), (0.15, False)])
def test_play_under_a_load_that_does_not_turn_round_and_an_encoders_zero_are_rivals(
    searches: Searches, apart: float, are_rivals: bool
):
    zero = searches.tried(Candidate(ZERO, "elbow"), _BAD, _GOOD)
    worse = _GOOD + apart * float((_BAD - _GOOD).mean())
    play = searches.tried(Candidate(PLAY, "elbow"), _BAD, worse)
    play = replace(play, fit=replace(play.fit, cost=zero.fit.cost))
    expected = (play,) if are_rivals else ()
    assert simplest([play, zero], np.random.default_rng(0)) == (zero, expected)


def test_of_causes_that_are_followed_the_best_is_told_without_what_the_base_could_do(
    searches: Searches,
):
    """Where only held-out motion goes the base is wrong, with whichever cause, by chance less."""
    there = np.where(np.arange(8) % 3 == 0, 3.0, 0.0)
    right = searches.tried(ELBOW, _BAD, _GOOD + there)
    wrong = searches.tried(LIFT, _BAD, _GOOD + 0.5 * there + 0.3)
    assert simplest([right, wrong], np.random.default_rng(0))[0] is wrong

    def followed(one: Tried, after: Float64) -> Tried:
        told = Foretold(9.0, 0.9, 1.0, _GOOD + 2.0, after)
        gain = replace(one.gain, before=left, apart=Taken(3.1, 3.1 - float(after.mean())))
        return replace(one, foretold=told, gain=gain)

    left = 1.2

    both = [followed(right, _GOOD), followed(wrong, _GOOD + 0.3)]
    assert simplest(both, np.random.default_rng(0)) == (both[0], ())
    mixed = [both[0], wrong]  # of one it is not known
    assert simplest(mixed, np.random.default_rng(0))[0] is wrong
    left = 9.0  # there the base would make up for what is large
    much = [followed(right, _GOOD), followed(wrong, _GOOD + 0.3)]
    assert simplest(much, np.random.default_rng(0))[0] is much[1]


def test_what_explains_something_else_as_well_is_no_rival(searches: Searches):
    found, (train, test) = searches.search(_BAD), map(searches.problem.of, ("train", "test"))
    one = searches.tried(ELBOW, _BAD[:4], _GOOD[:4])  # stretches of what is held out
    other = searches.tried(LIFT, _BAD[:4], _GOOD[:4])
    assert is_rival(found, one, other, train, test)
    apart = replace(other, screened=replace(other.screened, signature=np.array([0.3, 0.95])))
    assert not is_rival(found, one, apart, train, test)
    turns = replace(apart.screened, candidate=Candidate(TURNS, ""))
    assert is_rival(found, one, replace(apart, screened=turns), train, test)


@pytest.mark.parametrize(("more", "cost"), [(0.02, 1.0), (0.0, 1.2)])
def test_turns_that_do_surely_worse_than_a_delay_are_no_rival(
    searches: Searches, more: float, cost: float
):
    late = searches.tried(Candidate(LATE, ""), _BAD, _GOOD)
    turns = searches.tried(Candidate(TURNS, ""), _BAD, _GOOD + more, numbers=2)
    worse = replace(turns, fit=replace(turns.fit, cost=cost * late.fit.cost + cost - 1.0))
    assert simplest([worse, late], np.random.default_rng(0)) == (late, ())


def test_a_search_without_a_candidate_is_over(searches: Searches):
    found = searches.search(_BAD)
    found.candidates = ()
    search(found, silent)
    assert found.accepted == []


_opened: list[str] = []
_is_watching = False


def _watch(event: str, details: tuple[Any, ...]) -> None:
    if _is_watching and event == "open":
        _opened.append(str(details[0]))


@contextmanager
def watching() -> Iterator[None]:
    """Take note of every file that Python opens; a hook stays for good, so it is switched."""
    global _is_watching
    _opened.clear()
    _is_watching = True
    try:
        yield
    finally:
        _is_watching = False


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    sys.addaudithook(_watch)
    folder = tmp_path_factory.mktemp("hidden") / "set"
    wish = wish_of("torque_bias@elbow=0.4")
    recipe = Recipe(arm="torque2", wishes=(wish,), seconds=2.0, train=1, test=1, seed=11)
    return hide(folder, recipe)


def steady(verdict: Verdict) -> bytes:
    """Return a verdict without what a clock says."""
    return msgspec.json.encode(msgspec.structs.replace(verdict, cpu_s=0.0, seconds={}))


def test_the_same_seed_gives_the_same_verdict_and_the_truth_is_never_read(dataset: Dataset):
    truth = dataset.folder / "truth.toml"
    with watching():
        truth.read_bytes()
        assert str(truth) in _opened
        _opened.clear()
        first = identify(dataset, seed=5, catalogue=(BIAS, GAIN)).verdict
    assert _opened  # the model file, at least
    assert not [path for path in _opened if "truth" in Path(path).name]
    truth.unlink()
    assert steady(identify(dataset, seed=5, catalogue=(BIAS, GAIN)).verdict) == steady(first)
