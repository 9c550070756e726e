"""What a run's state holds of each version and each stage; plain data, filled by the fold."""

import dataclasses

from shared.messages.league import Stage
from shared.messages.training import Agent, UpdateMetrics


@dataclasses.dataclass(frozen=True)
class VersionRecord:
    """One policy version in the ledger."""

    agent: Agent
    version: int
    stage: int
    """-1 for version 0."""
    snapshot: str
    """Content hash (64 hex digits)."""
    rollouts: tuple[str, ...]
    metrics: UpdateMetrics | None
    at_ns: int

    @property
    def ref(self) -> str:
        """Return the player reference of this version."""
        return f"sha256:{self.snapshot}"


@dataclasses.dataclass
class CurvePoint:
    """The complete training bouts that ended while a stage had made ``update`` updates."""

    update: int
    """Updates of the stage so far, from 0."""
    total_samples: int
    """Samples both agents together had learned from, over the whole run."""
    at_ns: int
    """When the first of these bouts entered the ledger."""
    score: list[float] = dataclasses.field(default_factory=list[float])
    """The antagonist's total of each bout."""
    attack_steps: list[int] = dataclasses.field(default_factory=list[int])
    penalty_steps: list[int] = dataclasses.field(default_factory=list[int])
    camping_steps: list[int] = dataclasses.field(default_factory=list[int])

    @property
    def mean(self) -> float:
        """Return the mean score; there is at least one bout in every point."""
        return sum(self.score) / len(self.score)


@dataclasses.dataclass
class StageRecord:
    """One stage: its order, the versions made in it, the bouts played in it."""

    stage: Stage
    started_at_ns: int
    ended_at_ns: int | None = None
    end_reason: str = ""
    """``converged`` or ``budget``; empty while it runs."""
    end_version: int = -1
    end_snapshot: str = ""
    """Content hash of what the agent had learned when the stage ended."""
    versions: list[VersionRecord] = dataclasses.field(default_factory=list[VersionRecord])
    points: list[CurvePoint] = dataclasses.field(default_factory=list[CurvePoint])
    """Learning curve, oldest first; updates in which no complete bout ended have no point."""
    complete_bouts: int = 0
    incomplete_bouts: int = 0
    restarts: int = 0
    """How many of the versions were made from no rollout: the learner went back to an earlier
    policy."""

    @property
    def updates(self) -> int:
        """Return how many updates were made in this stage."""
        return len(self.versions) - self.restarts

    @property
    def end_ref(self) -> str:
        """Return the player reference of what the agent had learned when the stage ended."""
        return f"sha256:{self.end_snapshot}"

    @property
    def end_label(self) -> str:
        """Return that player's name: ``antagonist 2``; in a round ``antagonist 3.12``."""
        stage = self.stage
        number = f"{stage.round}.{stage.iteration}" if stage.round else f"{stage.iteration}"
        return f"{stage.agent} {number}"

    @property
    def samples(self) -> int:
        """Return the samples learned from in this stage."""
        return sum(version.metrics.samples for version in self.versions if version.metrics)
