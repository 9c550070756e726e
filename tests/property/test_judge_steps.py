import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.game.bout import Scoreboard
from shared.game.geometry import BatShape, Target
from shared.game.reward import RewardConfig, reward
from shared.game.rules import RuleBook


@pytest.mark.parametrize("camping", ["every_step", "once"])
@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), steps=st.integers(1, 10), bouts=st.integers(1, 9))
def test_steps_judged_together_get_the_verdicts_of_steps_judged_one_by_one(
    camping: str, seed: int, steps: int, bouts: int
):
    generator = np.random.default_rng(seed)
    rules = RuleBook(camping_steps=2, camping=camping)
    one_by_one, together = (Scoreboard(bouts, rules, BatShape(), Target()) for _ in range(2))
    for _ in range(3):
        grips = generator.normal((0.0, 0.0, 1.0), 0.3, (2, steps, bouts, 3)).transpose(3, 0, 1, 2)
        quaternions = generator.standard_normal((4, 2, steps, bouts))
        quaternions /= np.linalg.norm(quaternions, axis=0)
        alone = [
            one_by_one.judge(grips[:, :, step], quaternions[:, :, step]) for step in range(steps)
        ]
        judged = together.judge_steps(grips, quaternions)
        rewards = reward(1, judged, 1.0, 0.4, RewardConfig())
        for step, judgement in enumerate(alone):
            assert np.array_equal(judged.points[step], judgement.points)
            assert np.array_equal(judged.target_distance[:, step], judgement.target_distance)
            assert np.array_equal(rewards[step], reward(1, judgement, 1.0, 0.4, RewardConfig()))
        for field in dataclasses.fields(alone[-1]):
            newest = getattr(judged.newest, field.name)
            assert np.array_equal(newest, getattr(alone[-1], field.name)), field.name
        for name, counter in one_by_one.state().items():
            assert np.array_equal(together.state()[name], counter), name
            assert together.state()[name].dtype == counter.dtype
