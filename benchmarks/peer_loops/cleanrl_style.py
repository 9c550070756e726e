"""PPO in one file, as CleanRL writes it: one process, the batched environment, no framework.

After `ppo_continuous_action.py` of CleanRL (Huang et al., JMLR 23:274, 2022): orthogonal
initialisation, separate networks, state-independent log std, normalised observations and
advantages, no bootstrap at time-outs.
"""
# pyright: basic

import itertools

import numpy as np
import torch
from torch import nn

from benchmarks.peer_loops.work import INPUTS, OUTPUTS, Timing, Work, main


class RunningScale:
    """Mean and variance of all observations so far, by Chan's parallel update."""

    def __init__(self, dim: int) -> None:
        self.mean = np.zeros(dim)
        self.variance = np.ones(dim)
        self.count = 1e-4

    def __call__(self, rows: np.ndarray) -> np.ndarray:
        """Take rows in; return float32 rows in units of the standard deviation."""
        count, mean, variance = len(rows), rows.mean(0), rows.var(0)
        total = self.count + count
        delta = mean - self.mean
        spread = self.variance * self.count + variance * count
        self.variance = (spread + delta**2 * self.count * count / total) / total
        self.mean = self.mean + delta * count / total
        self.count = total
        return self.scaled(rows)

    def scaled(self, rows: np.ndarray) -> np.ndarray:
        """Return float32 rows in units of the standard deviation so far."""
        scaled = (rows - self.mean) / np.sqrt(self.variance + 1e-8)
        return np.clip(scaled, -10.0, 10.0).astype(np.float32)


def _network(sizes: list[int], gain: float) -> nn.Sequential:
    layers: list[nn.Module] = []
    for at, (size, following) in enumerate(itertools.pairwise(sizes)):
        is_last = at == len(sizes) - 2
        layer = nn.Linear(size, following)
        nn.init.orthogonal_(layer.weight, gain if is_last else np.sqrt(2))
        nn.init.zeros_(layer.bias)
        layers += [layer] if is_last else [layer, nn.Tanh()]
    return nn.Sequential(*layers)


def loop(work: Work) -> Timing:
    """Train until the window is over."""
    torch.set_num_threads(work.threads)
    torch.manual_seed(work.seed)
    watch = work.stopwatch()
    bouts = work.batch()
    actor = _network([INPUTS, *work.hidden_dims, OUTPUTS], 0.01)
    critic = _network([INPUTS, *work.hidden_dims, 1], 1.0)
    log_std = nn.Parameter(torch.full((OUTPUTS,), float(np.log(work.initial_std))))
    parameters = [*actor.parameters(), *critic.parameters(), log_std]
    adam = torch.optim.Adam(parameters, lr=work.learning_rate, eps=1e-5)

    T, N = work.steps, work.num_envs
    obs = torch.zeros(T, N, INPUTS)
    actions, logs = torch.zeros(T, N, OUTPUTS), torch.zeros(T, N)
    rewards, dones, values = torch.zeros(T, N), torch.zeros(T, N), torch.zeros(T, N)
    scale = RunningScale(INPUTS)
    seen = torch.from_numpy(scale(bouts.reset()))
    ended = torch.zeros(N)
    samples = 0

    def act(rows: np.ndarray) -> np.ndarray:
        with torch.no_grad():
            return actor(torch.from_numpy(scale.scaled(rows))).clamp(-1.0, 1.0).numpy()

    while True:
        with torch.no_grad():
            for t in range(T):
                obs[t], dones[t] = seen, ended
                normal = torch.distributions.Normal(actor(seen), log_std.exp())
                action = normal.sample()
                actions[t], logs[t] = action, normal.log_prob(action).sum(1)
                values[t] = critic(seen).flatten()
                turn = bouts.step(np.clip(action.numpy(), -1.0, 1.0))
                rewards[t] = torch.from_numpy(turn.paid.astype(np.float32))
                seen = torch.from_numpy(scale(turn.obs))
                ended = torch.from_numpy(turn.ended.astype(np.float32))
            advantages, ahead = torch.zeros(T, N), torch.zeros(N)
            following, goes_on = critic(seen).flatten(), 1.0 - ended
            for t in reversed(range(T)):
                error = rewards[t] + work.gamma * following * goes_on - values[t]
                ahead = error + work.gamma * work.gae_lambda * goes_on * ahead
                advantages[t] = ahead
                following, goes_on = values[t], 1.0 - dones[t]
            returns = advantages + values
        flat = [x.flatten(0, 1) for x in (obs, actions, logs, advantages, returns)]
        for _ in range(work.epochs):
            for rows in torch.randperm(T * N).chunk(work.minibatches):
                o, a, old, gain, target = (x[rows] for x in flat)
                normal = torch.distributions.Normal(actor(o), log_std.exp())
                ratio = (normal.log_prob(a).sum(1) - old).exp()
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                clipped = ratio.clamp(1.0 - work.clip, 1.0 + work.clip)
                loss = (
                    -torch.min(gain * ratio, gain * clipped).mean()
                    + work.value_loss_coef * (critic(o).flatten() - target).square().mean()
                    - work.entropy_coef * normal.entropy().sum(1).mean()
                )
                adam.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(parameters, work.max_grad_norm)
                adam.step()
        samples += T * N
        if watch.update_done(samples, act):
            return watch.timing(samples)


if __name__ == "__main__":
    main(loop)
