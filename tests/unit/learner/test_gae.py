"""Generalised advantage estimation by hand, and as rsl_rl does it."""

import numpy as np
import pytest
import torch
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict

from services.learner.gae import advantages_and_returns
from services.learner.ppo import PolicyOptimiser
from tests.unit.learner.making import SMALL


def column(*values: float) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float32)[:, None]


def test_three_steps_by_hand():
    gamma, lam = 0.5, 0.5
    advantages, returns = advantages_and_returns(
        column(1.0, 2.0, 3.0),
        column(0.5, 1.5, 2.5),
        torch.tensor([4.0]),
        torch.tensor([False]),
        gamma,
        lam,
    )
    last = 3.0 + 0.5 * 4.0 - 2.5
    middle = 2.0 + 0.5 * 2.5 - 1.5 + 0.25 * last
    first = 1.0 + 0.5 * 1.5 - 0.5 + 0.25 * middle
    torch.testing.assert_close(advantages, column(first, middle, last))
    torch.testing.assert_close(returns, advantages + column(0.5, 1.5, 2.5))


def test_a_terminated_bout_has_no_future_and_a_truncated_one_has():
    rewards, values = torch.ones(2, 2), torch.zeros(2, 2)
    advantages, _ = advantages_and_returns(
        rewards, values, torch.tensor([10.0, 10.0]), torch.tensor([True, False]), 0.9, 1.0
    )
    torch.testing.assert_close(advantages[:, 0], torch.tensor([1.0 + 0.9, 1.0]))
    torch.testing.assert_close(
        advantages[:, 1], torch.tensor([1.0 + 0.9 + 0.81 * 10.0, 1.0 + 0.9 * 10.0])
    )


def test_lambda_one_gives_discounted_sums_and_lambda_zero_one_step_errors():
    generator = torch.Generator().manual_seed(0)
    rewards, values = torch.randn(2, 5, 3, generator=generator)
    last = torch.randn(3, generator=generator)
    alive = torch.zeros(3, dtype=torch.bool)
    _, returns = advantages_and_returns(rewards, values, last, alive, 0.9, 1.0)
    for step in range(5):
        expected = (
            sum(0.9**k * rewards[step + k] for k in range(5 - step)) + 0.9 ** (5 - step) * last
        )
        torch.testing.assert_close(returns[step], expected)
    advantages, _ = advantages_and_returns(rewards, values, last, alive, 0.9, 0.0)
    following = torch.cat([values[1:], last[None]])
    torch.testing.assert_close(advantages, rewards + 0.9 * following - values)


@pytest.mark.parametrize("steps", [1, 7, 40])
def test_aligned_data_gives_what_rsl_rl_computes(steps: int):
    worlds = 6
    optimiser = PolicyOptimiser(SMALL, 3)
    algorithm = optimiser._algorithm
    generator = torch.Generator().manual_seed(steps)
    obs = torch.randn(steps + 1, worlds, 27, generator=generator)
    rewards = torch.randn(steps, worlds, generator=generator)
    proto = TensorDict({"policy": obs[0]}, batch_size=[worlds])
    storage = algorithm.storage = RolloutStorage("rl", worlds, steps, proto, [6])
    with torch.no_grad():
        values = algorithm.critic(TensorDict({"policy": obs}, batch_size=obs.shape[:2])).squeeze(-1)
        storage.rewards.copy_(rewards[..., None])
        storage.values.copy_(values[:-1, :, None])
        algorithm.compute_returns(TensorDict({"policy": obs[-1]}, batch_size=[worlds]))
    advantages, returns = advantages_and_returns(
        rewards, values[:-1], values[-1], torch.zeros(worlds, dtype=torch.bool), 0.99, 0.95
    )
    torch.testing.assert_close(returns, storage.returns.squeeze(-1), atol=1e-6, rtol=1e-6)
    normalised = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
    np.testing.assert_allclose(normalised, storage.advantages.squeeze(-1), atol=1e-5)
