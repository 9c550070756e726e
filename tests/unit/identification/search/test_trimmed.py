"""Parts in which something happened are found by a base that is fitted to the others."""

import pytest

from shared.identification.catalogue import effects
from shared.identification.dataset.types import Dataset
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.noise import NoiseLevels
from shared.identification.hidden.recipe import Recipe, wish_of
from shared.identification.hidden.truth import Truth
from shared.identification.progress import silent
from shared.identification.search.begin import begin
from shared.identification.search.searched import Search
from shared.identification.search.trimmed import led_astray

_QUIET = NoiseLevels(torque=2e-4)
"""As on a bench: a push is far more than what pushes at random."""


def _begun(dataset: Dataset) -> Search:
    return begin(dataset, seed=0, progress=silent, without=frozenset(), catalogue=effects())


def _simulated(*wishes: str) -> tuple[Dataset, Truth]:
    return simulated(
        Recipe(
            arm="torque2", seconds=5.0, train=2, test=1, seed=7505, noise=_QUIET, spread=0.05,
            wishes=tuple(wish_of(each) for each in wishes), has_shares=False,
        )
    )  # fmt: skip


def test_a_push_that_leads_a_base_astray_is_set_aside_and_nothing_else_is():
    dataset, truth = _simulated("external_contact@shoulder in swings=2.0")
    at = {each.name: each.value for each in truth.effect[0].quantities}
    (span,) = led_astray(_begun(dataset))
    assert span.trajectory == "swings"
    assert span.begin <= at["begin"]
    assert at["begin"] + at["length"] <= span.end
    assert span.end - span.begin < at["length"] + 0.8


@pytest.mark.parametrize("wishes", [(), ("coulomb_friction@elbow=0.2",)])
def test_nothing_is_set_aside_where_nothing_happened_once(wishes: tuple[str, ...]):
    dataset, _ = _simulated(*wishes)
    assert led_astray(_begun(dataset)) == ()


def test_an_arm_that_is_held_is_left_alone():
    dataset, _ = simulated(
        Recipe(
            arm="arm3", seconds=3.0, train=2, test=1, seed=7506, has_shares=False,
            wishes=(wish_of("external_contact@elbow in swings=4.0"),),
        )
    )  # fmt: skip
    assert led_astray(_begun(dataset)) == ()
