"""The fast tier: an effect is hidden in an arm, noise and unknown parameters around it; find it.

The generator is another implementation than the finder's, at a finer time step. `riposte bench
identify` runs the whole protocol, with other seeds.
"""

import pytest

from shared.identification.find import identify
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, wish_of
from shared.identification.hidden.truth import Truth
from shared.identification.verdict import Tie, Verdict

pytestmark = pytest.mark.timeout(400)

HIDDEN = (
    ("command_latency=0.02", 9003),
    ("payload=0.6", 9004),
    ("encoder_offset@elbow=0.015", 9005),
    ("tracker_latency=0.01", 9006),
    ("joint_elasticity@shoulder=0.002", 9007),
    ("load_friction@shoulder=0.2", 9008),
    ("torque_bias@elbow=0.5", 9009),
    ("backlash@elbow=0.04", 9010),
    ("encoder_scale@shoulder=0.02", 9011),
    ("gravity_tilt=0.06", 9012),
)
LIFTS, PULLS = ("torque_bias@shoulder=5", 9201), ("torque_bias@shoulder=5.5", 9203)
"""Torques near one posture."""


def looked_at(wish: str, seed: int) -> tuple[Truth, Verdict]:
    """Hide something in a short data set and say what is found; half of the nulls are imperfect."""
    wishes = (wish_of(wish),) if wish else ()
    recipe = Recipe(
        arm="arm3", seconds=2.4, train=2, test=2, seed=seed, wishes=wishes,
        is_imperfect=not wish and seed % 2 == 0,
        reach=0.08 if (wish, seed) in (LIFTS, PULLS) else 1.0,
    )  # fmt: skip
    dataset, truth = simulated(recipe)
    return truth, identify(dataset).verdict


@pytest.mark.parametrize(("wish", "seed"), HIDDEN)
def test_what_is_hidden_is_found_where_it_is(wish: str, seed: int) -> None:
    truth, verdict = looked_at(wish, seed)
    hidden = truth.effect[0]
    assert verdict.verdict == "named", verdict.sentence
    assert [(cause.effect, cause.where) for cause in verdict.causes] == [
        (hidden.name, hidden.where)
    ], verdict.sentence
    assert verdict.causes[0].value == pytest.approx(hidden.quantities[0].value, rel=0.2)
    for name, interval in verdict.causes[0].other_intervals.items():
        assert interval.low < verdict.causes[0].others[name] < interval.high
    assert verdict.held_out.extended < 1.35 < 1.5 * verdict.held_out.base_fit


@pytest.mark.parametrize(("wish", "seed"), [("", seed) for seed in range(9101, 9111)])
def test_where_nothing_is_hidden_nothing_is_named(wish: str, seed: int) -> None:
    truth, verdict = looked_at(wish, seed)
    assert not truth.effect
    assert not verdict.causes, verdict.sentence
    allowed = ("none", "unexplained", "base_too_coarse") if seed % 2 == 0 else ("none",)
    assert verdict.verdict in allowed, verdict.sentence


@pytest.mark.parametrize("without", [(), ("backlash",)])
def test_what_is_not_in_the_catalogue_is_not_called_what_is_most_like_it(without: tuple[str, ...]):
    """Play of a gear whose load hardly turns round is nearly another zero of the encoder."""
    wishes = (wish_of("backlash@elbow=0.025"),)
    recipe = Recipe(arm="arm3", seconds=6.0, train=2, test=2, seed=9015, wishes=wishes)
    verdict = identify(simulated(recipe)[0], without=without).verdict
    causes = [(cause.effect, cause.where) for cause in verdict.causes]
    if not without:
        assert (verdict.verdict, causes) == ("named", [("backlash", "elbow")]), verdict.sentence
        return
    assert (verdict.verdict, causes) == ("unexplained", []), verdict.sentence
    assert "Nearest comes encoder offset of elbow" in verdict.sentence
    assert "fit what it leaves by more than chance" in verdict.sentence


def tied_with_base(hidden: tuple[str, int]) -> tuple[Verdict, Tie]:
    """Return what is said of a torque near one posture: a base, it, or a counterbalance."""
    truth, verdict = looked_at(*hidden)
    assert verdict.verdict == "tie", verdict.sentence
    (tie,) = verdict.ties
    base, *others = tie.causes
    assert (base.effect, base.where) == ("base model", "shoulder")
    assert {(each.effect, each.where) for each in others} == {
        ("torque_bias", "shoulder"), ("counterbalance", "shoulder"),
    }  # fmt: skip
    torque = next(each for each in others if each.effect == "torque_bias")
    assert torque.value == pytest.approx(truth.effect[0].quantities[0].value, rel=0.3)
    assert tie.alike > 0.99
    assert tie.record in verdict.record_next
    assert not verdict.causes
    return verdict, tie


def test_what_a_base_far_from_the_model_explains_is_told_from_nothing() -> None:
    verdict, tie = tied_with_base(LIFTS)
    base = tie.causes[0]
    assert base.interval.low > 1.65
    assert "kp shoulder" in base.others
    assert any("far from the model file" in each for each in verdict.caveats)


@pytest.mark.slow
def test_a_base_that_is_off_in_many_numbers_at_once_is_told_from_nothing() -> None:
    """No number of it is surely far by itself: a servo can be weaker by so much."""
    _, tie = tied_with_base(PULLS)
    assert tie.causes[0].interval.high < 1.0
