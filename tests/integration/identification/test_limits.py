"""What a verdict says that it would have named: hidden in the same arm and motion, it is."""

from dataclasses import replace

import pytest

from shared.identification.find import identify
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, Wish
from shared.identification.verdict import NAMED_SHARE, Limit, Verdict

RECIPE = Recipe(arm="arm3", seconds=4.0, train=2, test=2, seed=9321, has_shares=False)


@pytest.fixture(scope="module")
def nothing() -> Verdict:
    return identify(simulated(RECIPE)[0]).verdict


def _limit(verdict: Verdict, effect: str, where: str = "") -> Limit:
    (found,) = (each for each in verdict.limits if (each.effect, each.where) == (effect, where))
    return found


def test_every_effect_that_could_be_looked_for_has_a_limit(nothing: Verdict) -> None:
    assert nothing.verdict == "none"
    lasting = {each.effect for each in nothing.candidates} - {"external_contact"}
    limited = {each.effect for each in nothing.limits}
    assert lasting <= limited
    assert all(each.size is None or each.size > 0.0 for each in nothing.limits)
    assert _limit(nothing, "base_compliance").size is not None  # looked at with several sizes


@pytest.mark.parametrize(
    ("effect", "where"), [("torque_bias", "shoulder"), ("tracker_latency", "")]
)
def test_at_its_limit_an_effect_takes_off_a_tenth_and_is_named(
    nothing: Verdict, effect: str, where: str
) -> None:
    size = _limit(nothing, effect, where).size
    assert size is not None
    wishes = (Wish(effect, where, size),)
    verdict = identify(simulated(replace(RECIPE, wishes=wishes))[0]).verdict
    assert [(each.effect, each.where) for each in verdict.causes] == [(effect, where)]
    (own,) = (each for each in verdict.candidates if (each.effect, each.where) == (effect, where))
    assert own.gain is not None
    assert 0.5 * NAMED_SHARE < own.gain / verdict.held_out.base_fit**2 < 2.0 * NAMED_SHARE
    assert all((each.effect, each.where) != (effect, where) for each in verdict.limits)
