"""Which candidates are not worth a refit."""

from dataclasses import replace

import numpy as np
import pytest

from shared.identification.catalogue.external_contact import EFFECT as PUSH
from shared.identification.catalogue.load_friction import EFFECT as LOAD
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.catalogue.torque_saturation import EFFECT as SATURATION
from shared.identification.effect import Candidate
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, wish_of
from shared.identification.progress import silent
from shared.identification.search.begin import begin
from shared.identification.search.outlook import hopeless
from shared.identification.search.screen import Screened, screen
from shared.identification.search.searched import Search

SHOULDER, ELBOW = Candidate(LOAD, "shoulder"), Candidate(LOAD, "elbow")
YAW = Candidate(BIAS, "yaw")
OTHERS = (ELBOW, YAW, Candidate(BIAS, "shoulder"), Candidate(BIAS, "elbow"))
CANDIDATES = (SHOULDER, *OTHERS)


def begun(wish: str) -> Search:
    recipe = Recipe(
        arm="arm3", seed=7, wishes=(wish_of(wish),) if wish else (), has_shares=False, seconds=3.0,
        train=2, test=2,
    )  # fmt: skip
    dataset, _ = simulated(recipe)
    return begin(
        dataset, seed=0, progress=silent, without=frozenset(), catalogue=(LOAD, BIAS, PUSH)
    )


def seen(found: Search) -> dict[Candidate, Screened]:
    train = found.parts.space.problem.of("train")
    return {each.candidate: each for each in screen(found.parts, CANDIDATES, train)}


@pytest.fixture(scope="module")
def small() -> Search:
    """Return a search for a cause of little more than 1 % of the residual."""
    return begun("load_friction@shoulder=0.028")


def test_a_small_cause_has_a_prospect_and_most_of_what_is_not_there_has_none(small: Search):
    looked, is_hopeless = seen(small), hopeless(small)
    assert looked[SHOULDER].share < 0.02
    assert not is_hopeless(looked[SHOULDER])
    assert sum(is_hopeless(looked[each]) for each in OTHERS) >= 2


def test_where_nothing_is_hidden_hardly_anything_has_a_prospect():
    nothing = begun("")
    is_hopeless = hopeless(nothing)
    assert sum(is_hopeless(each) for each in seen(nothing).values()) >= 3


def test_what_links_could_make_up_for_there_is_refitted_if_it_may_be_much():
    nothing = begun("")
    torque = seen(nothing)[Candidate(BIAS, "elbow")]
    is_hopeless = hopeless(nothing)
    assert is_hopeless(torque)
    assert not is_hopeless(replace(torque, share=0.019))


def test_only_what_is_small_and_acts_all_the_time_is_left_out(small: Search):
    yaw, is_hopeless = seen(small)[YAW], hopeless(small)
    assert not is_hopeless(replace(yaw, share=0.05))
    assert not is_hopeless(replace(yaw, candidate=Candidate(SATURATION, "yaw")))
    once = Candidate(PUSH, "yaw in sines")
    assert not is_hopeless(replace(yaw, candidate=once, start=np.ones(3)))


def test_where_much_is_left_nothing_is_left_out(small: Search):
    far = replace(small, parts=replace(small.parts, cost=2.0 * len(small.parts.residual)))
    is_hopeless = hopeless(far)
    assert not any(is_hopeless(each) for each in seen(small).values())
