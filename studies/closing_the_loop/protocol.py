"""What the study hides, how long it records and trains, and whom it plays against."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

from shared.errors import ConfigError
from shared.sim.config import SimConfig

Condition = Literal["nominal", "base_fit", "extended"]
CONDITIONS: Final[tuple[Condition, ...]] = ("nominal", "base_fit", "extended")
"""The models that policies are trained in."""
SCRIPTED: Final = ("stab", "slash", "person-novice", "person-steady", "person-adaptive")
"""Antagonists that were not trained: two strokes, three simulated people."""
TRAINED: Final = "trained"
"""The antagonist that the first seed's nominal run trained; the same one for everybody."""
TWIN_TIMESTEP: Final = 0.002
"""Of the twin's physics: the hidden truth takes finer steps than training does (s)."""


@dataclass(frozen=True)
class Protocol:
    """The whole study; the defaults are what the results in README.md were made with."""

    delay: float = 0.06
    """Hidden: commands reach the servo so late (s)."""
    spread: float = 0.2
    """Hidden: each joint's damping and armature is off by up to so much (1)."""
    hidden_seed: int = 11
    seconds: float = 75.0
    """Of the recording programme."""
    countdown: float = 0.5
    """Before each recording; nobody has to step back here (s)."""
    seeds: tuple[int, ...] = (1, 2, 3)
    updates: tuple[int, int] = (100, 160)
    """Most PPO updates of the antagonist, then of the protagonist."""
    iterations: int = 1
    """Of phase one."""
    train: tuple[str, ...] = ()
    """More settings of `riposte train`."""
    bouts: int = 32
    """Of each protagonist against each antagonist."""
    bout_steps: int = 2000
    only: tuple[str, ...] = ()
    """Recordings of the programme to play; all where none is named."""
    antagonists: tuple[str, ...] = field(default=(*SCRIPTED, TRAINED))

    @property
    def twin(self) -> SimConfig:
        """Return the twin's settings, but for its model."""
        return SimConfig(physics_timestep=TWIN_TIMESTEP)


SMOKE: Final = Protocol(
    seconds=40.0,
    seeds=(1,),
    updates=(1, 1),
    iterations=1,
    train=(
        "actor.num_envs=8", "actor.rollout_steps=50", "game.bout_steps=100",
        "learner.batch_samples=400", "learner.warm_up_samples=400", "learner.minibatches=4",
        "learner.hidden_dims=[16,16]", "league.evaluation_bouts=8",
        "league.convergence_min_updates=0",
    ),
    bouts=4,
    bout_steps=100,
    only=("sines", "swings", "sines_again", "other_sines"),
    antagonists=("stab", TRAINED),
)  # fmt: skip
"""Every stage, as small as it can be: its results mean nothing."""


@dataclass(frozen=True)
class Folders:
    """Where each stage keeps what it made, so that it is made once."""

    root: Path

    @property
    def truth(self) -> Path:
        """Return the hidden model of the twin."""
        return self.root / "hidden.toml"

    @property
    def programme(self) -> Path:
        """Return what is played."""
        return self.root / "programme"

    @property
    def recorded(self) -> Path:
        """Return the run on the twin, with the archive of its bouts."""
        return self.root / "recorded"

    @property
    def dataset(self) -> Path:
        """Return what the finder reads."""
        return self.root / "dataset"

    @property
    def found(self) -> Path:
        """Return what `riposte identify` writes."""
        return self.root / "identified"

    def model(self, condition: Condition) -> str:
        """Return what ``sim.model`` is in a condition."""
        if condition == "nominal":
            return "nominal"
        name = "base_fit.toml" if condition == "base_fit" else "model.toml"
        return str(self.found / name)

    def training(self, condition: Condition, seed: int) -> Path:
        """Return a training run's folder."""
        return self.root / "trained" / f"{condition}-{seed}"

    @property
    def scores(self) -> Path:
        """Return the scores in play."""
        return self.root / "scores.json"


def need(path: Path, stage: str) -> Path:
    """Return a path that an earlier stage made.

    Raises:
        ConfigError: it did not; says which stage to run.
    """
    if not path.exists():
        raise ConfigError(f"{path} is missing: run the stage {stage!r} first")
    return path


def runs_of(protocol: Protocol) -> Sequence[tuple[Condition, int]]:
    """Return every training, seed by seed, so that an interrupted study has whole comparisons."""
    return [(condition, seed) for seed in protocol.seeds for condition in CONDITIONS]
