"""Configuration of a learner (section ``[learner]``)."""

from typing import Literal

import msgspec

from shared.messages.league import Stage


class LearnerConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One agent's PPO; the defaults are those the README's numbers were made with."""

    seed: int = 0
    """Seed of the run; weights, minibatches and their order follow from it."""
    batch_samples: int = 20480
    """Samples of one update; rollouts are gathered until there are that many."""
    hidden_dims: tuple[int, ...] = (64, 64)
    """Widths of the hidden layers, of actor and critic alike."""
    activation: Literal["tanh", "elu"] = "tanh"
    initial_std: float = 0.6
    """Standard deviation of a fresh policy, in units of the action bound."""
    minimum_std: float = 0.05
    maximum_std: float = 1.0
    epochs: int = 4
    """Passes over an update's samples."""
    minibatches: int = 8
    """Parts each pass is cut into."""
    learning_rate: float = 1e-3
    """Adam's step at the start of a stage; never adaptive to KL, which late rollouts feign."""
    final_learning_rate: float = 1e-4
    """Adam's step at the end of the stage's budget; it falls linearly in between."""
    phase_two_learning_rate: float = 3e-4
    """Adam's step in phase two, always the same: its stages are too short for one to fall."""
    gamma: float = 0.99
    """Discount per control step."""
    gae_lambda: float = 0.95
    clip: float = 0.2
    """PPO's ratio clip."""
    entropy_coef: float = 0.001
    value_loss_coef: float = 1.0
    max_grad_norm: float = 1.0
    max_lag: int = 1
    """Accept rollouts of versions down to current - this."""
    warm_up_samples: int = 20480
    """Samples that only teach the observation normaliser before the first update."""
    keep_checkpoints: int = 3
    """Checkpoints kept on disk, newest first."""
    device: str = "cpu"
    """Where PPO computes: ``cpu``, ``cuda`` or ``cuda:N``, with a torch that knows it."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        for name in ("batch_samples", "epochs", "minibatches", "keep_checkpoints"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} ({getattr(self, name)}) must be at least 1")
        if self.batch_samples < 2 * self.minibatches:
            raise ValueError(
                f"batch_samples ({self.batch_samples}) must give each of the {self.minibatches} "
                "minibatches two samples"
            )
        if not self.hidden_dims or min(self.hidden_dims) < 1:
            raise ValueError(f"hidden_dims ({self.hidden_dims}) must hold positive widths")
        if not 0.0 < self.minimum_std <= self.initial_std <= self.maximum_std:
            raise ValueError(
                f"initial_std ({self.initial_std}) must lie between minimum_std "
                f"({self.minimum_std}) and maximum_std ({self.maximum_std}), all positive"
            )
        for name in (
            "learning_rate",
            "final_learning_rate",
            "phase_two_learning_rate",
            "clip",
            "max_grad_norm",
        ):
            if getattr(self, name) <= 0.0:
                raise ValueError(f"{name} ({getattr(self, name)}) must be positive")
        for name in ("gamma", "gae_lambda"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} ({getattr(self, name)}) must be in [0, 1]")
        for name in ("max_lag", "warm_up_samples", "entropy_coef", "value_loss_coef"):
            if getattr(self, name) < 0:
                raise ValueError(f"{name} ({getattr(self, name)}) must not be negative")

    def learning_rate_in(self, stage: Stage | None, updates: int) -> float:
        """Return Adam's step after so many updates of a stage: a line down to its budget's end.

        It follows from the stage alone, so that late rollouts cannot move it. In phase two it
        does not fall.
        """
        if stage is not None and stage.phase == "two":
            return self.phase_two_learning_rate
        return self.learning_rate_at(0.0 if stage is None else updates / stage.max_updates)

    def learning_rate_at(self, share: float) -> float:
        """Return Adam's step at a share of a stage's budget; beyond its end it stays."""
        share = min(share, 1.0)
        return self.learning_rate + share * (self.final_learning_rate - self.learning_rate)
