"""Something pushed the arm once, in a recording that was fitted to: too little to stand out."""

import pytest

from shared.identification.find import identify
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, wish_of

pytestmark = pytest.mark.timeout(400)


@pytest.mark.slow
@pytest.mark.parametrize(("wish", "seed"), [
    ("external_contact@elbow in swings=0.22", 6006),
    ("external_contact@yaw in sweep=1.66", 6002),
])  # fmt: skip
def test_what_is_plain_by_the_torque_that_was_missing_is_named(wish: str, seed: int):
    recipe = Recipe(arm="arm3", seconds=4.0, seed=seed, wishes=(wish_of(wish),), has_shares=False)
    dataset, truth = simulated(recipe)
    verdict = identify(dataset, seed=seed).verdict
    torque, begin, length = (each.value for each in truth.effect[0].quantities)
    assert verdict.verdict == "named", verdict.sentence
    (cause,) = verdict.causes
    assert (cause.effect, cause.where) == ("external_contact", truth.effect[0].where)
    assert cause.interval.low <= torque <= cause.interval.high
    assert cause.other_units == {"begin": "s", "length": "s"}
    assert cause.others["begin"] == pytest.approx(begin, abs=0.05)
    assert cause.others["length"] == pytest.approx(length, rel=0.2)
    assert not verdict.unexplained
