"""rsl_rl's PPO fed with rollouts that came over the bus: fill its storage, call ``update``.

rsl_rl 5.5.1 reports no KL, clip fraction or explained variance and trains silently on rows that
were never filled; this file fills every row itself and measures the rest.
"""
# pyright: basic

import dataclasses
import math
from collections.abc import Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from rsl_rl.algorithms import PPO
from rsl_rl.models import MLPModel
from rsl_rl.storage import RolloutStorage
from tensordict import TensorDict

from services.learner.config import LearnerConfig
from services.learner.devices import RandomState, device_of
from services.learner.gae import advantages_and_returns
from services.learner.lean import LeanGaussian, ShuffledStorage, make_lean
from shared.errors import CheckpointError
from shared.messages.training import ACTION_DIM, OBS_DIM, Rollout
from shared.policy.mlp import PolicyWeights

_GROUPS = {"actor": ["policy"], "critic": ["policy"]}
_LOOKED_AT_AGAIN = 4
"""Divergence and clipping of an update are measured on every so manieth sample."""


@dataclasses.dataclass(frozen=True)
class UpdateStats:
    """What one PPO update did, over its own samples."""

    samples: int
    reward_mean: float
    value_loss: float
    surrogate_loss: float
    entropy: float
    approx_kl: float
    clip_fraction: float
    explained_variance: float
    action_std: float


def _observations(obs: torch.Tensor) -> TensorDict:
    return TensorDict({"policy": obs}, batch_size=obs.shape[:-1])


class PolicyOptimiser:
    """Actor, critic, normalisers, Adam and the random state of one agent."""

    def __init__(self, cfg: LearnerConfig, seed: int) -> None:
        """Build them.

        Args:
            cfg: of the learner.
            seed: of weights and minibatches.

        Raises:
            ConfigError: there is no such device.
        """
        torch.set_num_threads(1)
        self.cfg = cfg
        self._device = device_of(cfg.device)
        self._random = RandomState(self._device)
        with self._random.forked():
            torch.manual_seed(seed)
            self._algorithm = self._build()
            self._random.keep()

    def _build(self) -> PPO:
        """Return a fresh algorithm; draws the weights from torch's current generator."""
        cfg = self.cfg
        proto = _observations(torch.zeros(1, OBS_DIM))
        actor = MLPModel(
            proto,
            _GROUPS,
            "actor",
            ACTION_DIM,
            cfg.hidden_dims,
            cfg.activation,
            obs_normalization=True,
            distribution_cfg={
                "class_name": LeanGaussian,
                "init_std": cfg.initial_std,
                "std_type": "log",
                "std_range": (cfg.minimum_std, cfg.maximum_std),
            },
        )
        critic = MLPModel(
            proto, _GROUPS, "critic", 1, cfg.hidden_dims, cfg.activation, obs_normalization=True
        )
        for model in (actor, critic):
            make_lean(model.mlp)
        # A last layer 100 times smaller: a fresh policy holds still (Andrychowicz 2021, sec. 3.2).
        with torch.no_grad():
            last = _linear_layers(actor)[-1]
            last.weight.mul_(0.01)
            last.bias.zero_()
        algorithm = PPO(
            actor.to(self._device),
            critic.to(self._device),
            RolloutStorage("rl", 1, 1, proto, [ACTION_DIM], device=str(self._device)),
            num_learning_epochs=cfg.epochs,
            num_mini_batches=cfg.minibatches,
            clip_param=cfg.clip,
            gamma=cfg.gamma,
            lam=cfg.gae_lambda,
            value_loss_coef=cfg.value_loss_coef,
            entropy_coef=cfg.entropy_coef,
            learning_rate=cfg.learning_rate,
            max_grad_norm=cfg.max_grad_norm,
            use_clipped_value_loss=False,
            schedule="fixed",
            device=str(self._device),
        )
        parameters = (*algorithm.actor.parameters(), *algorithm.critic.parameters())
        algorithm.optimizer = torch.optim.Adam(parameters, cfg.learning_rate, fused=True)
        algorithm.train_mode()
        return algorithm

    def warm_up(self, rollouts: Sequence[Rollout]) -> None:
        """Teach the normalisers, and nothing else, from these rollouts."""
        self._normalise(_observations(self._rows(rollouts, "obs")))

    def _normalise(self, obs: TensorDict) -> None:
        """Move both normalisers: they have always seen the same."""
        actor, critic = self._algorithm.actor, self._algorithm.critic
        actor.update_normalization(obs)
        critic.obs_normalizer.load_state_dict(actor.obs_normalizer.state_dict())

    def update(
        self, rollouts: Sequence[Rollout], learning_rate: float | None = None
    ) -> UpdateStats:
        """Run one PPO update on exactly these rollouts.

        Args:
            rollouts: checked ones; their rows are used in this order.
            learning_rate: Adam's step; the configured one without it.
        """
        for group in self._algorithm.optimizer.param_groups:
            group["lr"] = learning_rate or self.cfg.learning_rate
        with self._random.forked():
            self._random.put_back()
            stats = self._update(rollouts)
            self._random.keep()
        return stats

    def _update(self, rollouts: Sequence[Rollout]) -> UpdateStats:
        algorithm = self._algorithm
        obs = _observations(self._rows(rollouts, "obs"))
        actions = self._rows(rollouts, "actions")
        means = self._rows(rollouts, "means")
        old_log_probs = self._rows(rollouts, "log_probs")
        stds = torch.cat(
            [torch.tensor(r.stds).expand(r.rewards.size, ACTION_DIM) for r in rollouts]
        ).to(self._device)
        samples = len(actions)
        with torch.no_grad():
            values = algorithm.critic(obs).squeeze(-1)
            advantages, returns = self._targets(rollouts, values)
            normalised = (advantages - advantages.mean()) / (advantages.std() + 1e-8)

        storage = ShuffledStorage("rl", 1, samples, obs[:1], [ACTION_DIM], device=str(self._device))
        storage.observations["policy"] = obs["policy"][:, None]
        storage.actions = actions[:, None]
        storage.values = values[:, None, None]
        storage.actions_log_prob = old_log_probs[:, None, None]
        storage.distribution_params = (means[:, None], stds[:, None])
        storage.returns = returns[:, None, None]
        storage.advantages = normalised[:, None, None]
        storage.step = samples
        algorithm.storage = storage
        # rsl_rl moves the normaliser at the end of update(); what is measured below is measured
        # with the policy as trained, before that, so the move is done here, afterwards.
        algorithm.actor.eval()
        algorithm.critic.eval()
        losses = algorithm.update()
        # Outside its range the clamped deviation has no gradient and would never come back.
        with torch.no_grad():
            _log_std(algorithm.actor).clamp_(
                math.log(self.cfg.minimum_std), math.log(self.cfg.maximum_std)
            )
        some = slice(None, None, _LOOKED_AT_AGAIN)
        with torch.no_grad():
            algorithm.actor(obs[some], stochastic_output=True)
            log_probs = algorithm.actor.get_output_log_prob(actions[some])
            new_params = algorithm.actor.output_distribution_params
            divergence = algorithm.actor.get_kl_divergence((means[some], stds[some]), new_params)
            ratio = torch.exp(log_probs - old_log_probs[some])
        algorithm.train_mode()
        self._normalise(obs)
        return UpdateStats(
            samples=samples,
            reward_mean=float(np.mean([r.rewards.mean() for r in rollouts])),
            value_loss=float(losses["value"]),
            surrogate_loss=float(losses["surrogate"]),
            entropy=float(losses["entropy"]),
            approx_kl=float(divergence.mean()),
            clip_fraction=float(((ratio - 1.0).abs() > self.cfg.clip).float().mean()),
            explained_variance=float(1.0 - (returns - values).var() / (returns.var() + 1e-8)),
            action_std=float(new_params[1][0].mean()),
        )

    def _rows(self, rollouts: Sequence[Rollout], field: str, axes: int = 2) -> torch.Tensor:
        """Return one field of all rollouts, their first ``axes`` axes flattened into one."""
        parts = [getattr(rollout, field) for rollout in rollouts]
        stacked = np.concatenate([part.reshape(-1, *part.shape[axes:]) for part in parts])
        return torch.from_numpy(stacked).to(self._device)

    def _targets(
        self, rollouts: Sequence[Rollout], values: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Return advantages float32[M] and returns float32[M], rollout by rollout."""
        last_obs = _observations(self._rows(rollouts, "last_obs", axes=1))
        last_values = self._algorithm.critic(last_obs).squeeze(-1)
        advantages, returns = [], []
        row, world = 0, 0
        for rollout in rollouts:
            steps, worlds = rollout.rewards.shape
            one_advantages, one_returns = advantages_and_returns(
                torch.tensor(rollout.rewards, device=self._device),
                values[row : row + steps * worlds].view(steps, worlds),
                last_values[world : world + worlds],
                # A bout ends by its clock alone: truncated, never terminated.
                torch.zeros(worlds, dtype=torch.bool, device=self._device),
                self.cfg.gamma,
                self.cfg.gae_lambda,
            )
            advantages.append(one_advantages.flatten())
            returns.append(one_returns.flatten())
            row += steps * worlds
            world += worlds
        return torch.cat(advantages), torch.cat(returns)

    def weights(self) -> PolicyWeights:
        """Return copies of what an actor needs to act."""
        actor = self._algorithm.actor
        normaliser = actor.obs_normalizer.state_dict()
        return PolicyWeights(
            obs_mean=_numpy(normaliser["_mean"][0]),
            obs_std=_numpy(normaliser["_std"][0]),
            layers=tuple((_numpy(m.weight), _numpy(m.bias)) for m in _linear_layers(actor)),
            log_std=_numpy(_log_std(actor)),
            activation=self.cfg.activation,
        )

    def state(self) -> dict[str, torch.Tensor]:
        """Return every tensor that the next update depends on, by name."""
        algorithm = self._algorithm
        state = self._random.state()
        for part in ("actor", "critic"):
            for name, value in getattr(algorithm, part).state_dict().items():
                state[f"{part}.{name}"] = value.detach().cpu().clone()
        for index, moments in algorithm.optimizer.state_dict()["state"].items():
            for name, value in moments.items():
                state[f"adam.{index}.{name}"] = value.detach().cpu().clone()
        return state

    def reseed(self, seed: int) -> None:
        """Draw the minibatches from another seed from now on."""
        with self._random.forked():
            torch.manual_seed(seed)
            self._random.keep()

    def restore(self, state: dict[str, torch.Tensor]) -> None:
        """Continue from what ``state`` returned.

        Raises:
            CheckpointError: if a tensor is missing or has another shape.
        """
        algorithm = self._algorithm
        optimizer = algorithm.optimizer.state_dict()
        optimizer["state"] = {}
        parts: dict[str, dict[str, torch.Tensor]] = {"actor": {}, "critic": {}}
        try:
            for name, value in state.items():
                part, _, rest = name.partition(".")
                if part == "adam":
                    index, _, moment = rest.partition(".")
                    optimizer["state"].setdefault(int(index), {})[moment] = value.clone()
                elif part in parts:
                    parts[part][rest] = value
            for part, tensors in parts.items():
                getattr(algorithm, part).load_state_dict(tensors)
            algorithm.optimizer.load_state_dict(optimizer)
            self._random.restore(state)
        except (KeyError, RuntimeError, ValueError) as error:
            text = " ".join(str(error).split())
            raise CheckpointError(f"checkpoint does not fit this network: {text}") from None


def _numpy(tensor: torch.Tensor) -> NDArray[np.float32]:
    return tensor.detach().cpu().numpy().astype(np.float32, copy=True)


def _linear_layers(model: MLPModel) -> list[torch.nn.Linear]:
    """Return the layers that have weights, in order."""
    return [module for module in model.mlp.modules() if isinstance(module, torch.nn.Linear)]


def _log_std(actor: MLPModel) -> torch.Tensor:
    """Return the parameter that holds the log of the standard deviation."""
    return dict(actor.named_parameters())["distribution.log_std_param"]
