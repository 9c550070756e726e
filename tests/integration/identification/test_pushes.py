"""Something pushed the arm once, in a recording that was fitted to: too little to stand out."""

import pytest

from shared.identification.find import identify
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, wish_of
from shared.identification.hidden.truth import Truth
from shared.identification.verdict import Verdict

pytestmark = pytest.mark.timeout(400)


def _pushed(wish: str, seed: int) -> tuple[Verdict, Truth]:
    recipe = Recipe(arm="arm3", seconds=4.0, seed=seed, wishes=(wish_of(wish),), has_shares=False)
    dataset, truth = simulated(recipe)
    return identify(dataset, seed=seed).verdict, truth


@pytest.mark.slow
def test_a_push_too_small_to_be_sure_of_is_told_and_not_named():
    verdict, truth = _pushed("external_contact@elbow in swings=0.22", 6006)
    _, begin, length = (each.value for each in truth.effect[0].quantities)
    assert verdict.verdict == "none", verdict.sentence
    (left,) = verdict.unexplained
    assert (left.where, left.trajectory, left.is_external) == ("elbow", "swings", True)
    assert (left.begin, left.end) == pytest.approx((begin, begin + length), abs=0.03)
    assert left.torque == pytest.approx(0.22, rel=0.1)
    assert "Something outside pushed elbow once" in verdict.sentence


@pytest.mark.slow
def test_what_is_plain_by_the_torque_that_was_missing_is_named():
    verdict, truth = _pushed("external_contact@yaw in sweep=1.66", 6002)
    torque, begin, length = (each.value for each in truth.effect[0].quantities)
    assert verdict.verdict == "named", verdict.sentence
    (cause,) = verdict.causes
    assert (cause.effect, cause.where) == ("external_contact", truth.effect[0].where)
    assert cause.interval.low <= torque <= cause.interval.high
    assert cause.other_units == {"begin": "s", "length": "s"}
    assert cause.others["begin"] == pytest.approx(begin, abs=0.05)
    assert cause.others["length"] == pytest.approx(length, rel=0.2)
    assert not verdict.unexplained
