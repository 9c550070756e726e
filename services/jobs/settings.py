"""All settings of a training run in one value: site file, budget, flags, and what follows."""

import math
from collections.abc import Sequence
from pathlib import Path

import msgspec

from services.actor.config import ActorConfig
from services.league.config import LeagueConfig
from services.learner.config import LearnerConfig
from services.recorder.config import RecorderConfig
from shared.bus.config import BusConfig
from shared.config.site import dump, load_section
from shared.errors import ConfigError
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.sim.config import SimConfig


class TrainConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What `riposte train` starts on this machine (section ``[train]``)."""

    seed: int = 0
    """Of everything random in the run."""
    actors: int = 1
    """Actor processes on this machine, one per spare core; 0 where all join from others."""
    record: bool = True
    """Run a recorder: the live view and recording.rrd."""
    tournament_bouts: int = 100
    """Of each pairing of the run's tournament, as in the paper."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not 0 <= self.seed < 2**31:
            raise ValueError(f"seed ({self.seed}) must be in 0 .. {2**31 - 1}")
        if not 0 <= self.actors <= 256:
            raise ValueError(f"actors ({self.actors}) must be in 0 .. 256")
        if not 1 <= self.tournament_bouts <= 100_000:
            raise ValueError(f"tournament_bouts ({self.tournament_bouts}) must be in 1 .. 100000")


BUDGETS: dict[str, tuple[str, ...]] = {
    "quick": (
        "league.antagonist_updates=60",
        "league.protagonist_updates=80",
        "league.evaluation_bouts=64",
        "league.round_iterations=6",
        "league.round_antagonist_updates=2",
        "league.round_protagonist_updates=2",
        "train.tournament_bouts=20",
    ),
    "standard": (),
    "paper": (
        "league.antagonist_updates=200",
        "league.protagonist_updates=600",
        "league.evaluation_bouts=256",
        "league.iterations=2",
        "league.round_iterations=35",
    ),
}
"""Overrides by budget; ``standard`` is what the defaults say. With ``--phase all`` each has six
rounds: ``quick`` is over within ten minutes on two cores, tournament and styles included."""


class Settings(msgspec.Struct, frozen=True, kw_only=True):
    """The sections of a site file that training reads."""

    bus: BusConfig
    sim: SimConfig
    game: RuleBook
    action: ActionConfig
    reward: RewardConfig
    actor: ActorConfig
    learner: LearnerConfig
    league: LeagueConfig
    recorder: RecorderConfig
    train: TrainConfig

    @staticmethod
    def load(site: Path | None, overrides: Sequence[str] = ()) -> "Settings":
        """Return every section, checked on its own and against the others.

        Args:
            site: site file; None for defaults.
            overrides: ``section.key=value``, the last one wins.

        Raises:
            ConfigError: names the value, what was expected and where it stands.
        """
        settings = Settings(
            **{
                field.name: load_section(site, field.name, field.type, overrides)
                for field in msgspec.structs.fields(Settings)
            }
        )
        return settings.resolved()

    def resolved(self) -> "Settings":
        """Return the settings with what follows from others filled in.

        Raises:
            ConfigError: two sections contradict each other.
        """
        if self.game.bout_steps % self.actor.rollout_steps:
            raise ConfigError(
                f"actor.rollout_steps ({self.actor.rollout_steps}) must divide "
                f"game.bout_steps ({self.game.bout_steps})"
            )
        per_rollout = self.actor.rollout_steps * self.actor.num_envs
        batch = max(self.learner.batch_samples, self.learner.warm_up_samples)
        league = msgspec.structs.replace(
            self.league,
            seed=self.train.seed,
            batch_rollouts=math.ceil(batch / per_rollout),
            batch_samples=batch,
            points_per_reward=1.0 / self.reward.score_scale,
        )
        learner = msgspec.structs.replace(self.learner, seed=self.train.seed)
        recorder = msgspec.structs.replace(self.recorder, bout_steps=self.game.bout_steps)
        return msgspec.structs.replace(self, league=league, learner=learner, recorder=recorder)

    def to_toml(self) -> str:
        """Return the settings as a site file, complete."""
        return dump({field: getattr(self, field) for field in self.__struct_fields__})
