"""The fast tier: an effect is hidden in an arm, noise and unknown parameters around it; find it.

The generator is another implementation than the finder's, at a finer time step. `riposte bench
identify` runs the whole protocol, with other seeds.
"""

import pytest

from shared.identification.find import identify
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, wish_of

pytestmark = pytest.mark.timeout(300)

SHORT = {"arm": "arm3", "seconds": 3.0, "train": 2, "test": 2}
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


@pytest.mark.parametrize(("wish", "seed"), HIDDEN)
def test_what_is_hidden_is_found_where_it_is(wish: str, seed: int) -> None:
    dataset, truth = simulated(Recipe(**SHORT, seed=seed, wishes=(wish_of(wish),)))
    hidden = truth.effect[0]
    verdict = identify(dataset).verdict
    assert verdict.verdict == "named", verdict.sentence
    assert [(cause.effect, cause.where) for cause in verdict.causes] == [
        (hidden.name, hidden.where)
    ], verdict.sentence
    assert verdict.causes[0].value == pytest.approx(hidden.quantities[0].value, rel=0.2)
    assert verdict.held_out.extended < 1.35 < 1.5 * verdict.held_out.base_fit


@pytest.mark.parametrize("seed", range(9101, 9111))
def test_where_nothing_is_hidden_nothing_is_named(seed: int) -> None:
    is_imperfect = seed % 2 == 0
    dataset, truth = simulated(Recipe(**SHORT, seed=seed, is_imperfect=is_imperfect))
    assert not truth.effect
    verdict = identify(dataset).verdict
    assert not verdict.causes, verdict.sentence
    allowed = ("none", "unexplained", "base_too_coarse") if is_imperfect else ("none",)
    assert verdict.verdict in allowed, verdict.sentence
