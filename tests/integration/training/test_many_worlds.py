"""A real run whose actor plays more worlds than one message has room for."""

import pytest

from benchmarks.training_run import ENDLESS, training_run
from services.actor.cutting import parts_of

WORLDS, STEPS = 1400, 40


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.timeout(240)
def test_rollouts_in_parts_are_all_learned_from():
    assert parts_of(STEPS, WORLDS) == 2
    words = (
        *ENDLESS, "train.record=false", "train.actors=1", f"actor.num_envs={WORLDS}",
        f"actor.rollout_steps={STEPS}", f"learner.batch_samples={WORLDS * STEPS}",
    )  # fmt: skip
    with training_run(words) as run:
        metrics = [run.wait_for_version(number).version.metrics for number in (4, 5)]
    earlier, later = metrics
    assert earlier is not None
    assert later is not None
    assert later.samples == WORLDS * STEPS
    assert later.total_samples == earlier.total_samples + WORLDS * STEPS
