"""Generalised advantage estimation on rollouts that know their true last observation."""

from torch import Tensor


def advantages_and_returns(
    rewards: Tensor,
    values: Tensor,
    last_values: Tensor,
    terminated: Tensor,
    gamma: float,
    lam: float,
) -> tuple[Tensor, Tensor]:
    """Return GAE advantages and value targets (Schulman 2016, eq. 16).

    A rollout holds one bout a world, so the only step after which nothing follows is its last.
    ``last_values`` is the value of the true observation after it, also where the bout ran out of
    time there; only a *terminated* bout has no future.

    Args:
        rewards: float32[T, N].
        values: float32[T, N], V of each observation.
        last_values: float32[N], V of the observation after the last step.
        terminated: bool[N], the game itself ended with the last step.
        gamma: discount per step.
        lam: GAE's lambda.

    Returns:
        Advantages float32[T, N], not normalised, and returns float32[T, N].
    """
    advantages = rewards.new_empty(rewards.shape)
    next_value = last_values * (~terminated).to(values.dtype)
    following = rewards.new_zeros(rewards.shape[1])
    for step in range(len(rewards) - 1, -1, -1):
        delta = rewards[step] + gamma * next_value - values[step]
        following = delta + (gamma * lam) * following
        advantages[step] = following
        next_value = values[step]
    return advantages, advantages + values
