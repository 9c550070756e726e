"""The same breakages with hypothesis at the dice: what it finds, it makes small."""

import contextlib
from random import Random

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.fuzz.entrances import robot, wire
from tests.fuzz.target import Target

TARGETS = [
    *wire.targets(wire.Path()),
    *(each for each in robot.targets(wire.Path()) if "/ros/" not in each.name),
]


@pytest.mark.slow
@pytest.mark.timeout(120)
@given(random=st.randoms(use_true_random=False), target=st.sampled_from(TARGETS))
@settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))
def test_what_is_broken_is_read_or_refused(random: Random, target: Target) -> None:
    data = target.mutate(random, random.choice(target.samples))
    with contextlib.suppress(target.refusals):
        target.read(data)
