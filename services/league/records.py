"""What a run's state holds of each version and each stage; plain data, filled by the fold."""

import dataclasses
import struct
from array import array
from collections.abc import MutableSequence
from typing import Any

import msgspec

from shared.messages.league import Stage
from shared.messages.training import Agent, UpdateMetrics

_NUMBERS = struct.Struct(
    "="
    + "".join("q" if field.type is int else "d" for field in msgspec.structs.fields(UpdateMetrics))
)
"""An update's numbers; a run has one for each version, and they are half of what it remembers."""


@dataclasses.dataclass(frozen=True, slots=True)
class VersionRecord:
    """One policy version in the ledger; the rollouts behind it stay there."""

    agent: Agent
    version: int
    stage: int
    """-1 for version 0."""
    snapshot: str
    """Content hash (64 hex digits)."""
    numbers: bytes
    """Of the update it was made by; empty where there are none."""
    at_ns: int

    @property
    def metrics(self) -> UpdateMetrics | None:
        """Return the numbers of the update it was made by."""
        return UpdateMetrics(**_named(self.numbers)) if self.numbers else None

    @property
    def ref(self) -> str:
        """Return the player reference of this version."""
        return f"sha256:{self.snapshot}"


def packed(metrics: UpdateMetrics | None) -> bytes:
    """Return the numbers of an update as a version's record keeps them.

    Raises:
        ValueError: a count is too large for 64 bits.
    """
    if metrics is None:
        return b""
    try:
        return _NUMBERS.pack(*msgspec.structs.astuple(metrics))
    except struct.error as error:
        raise ValueError(f"a count of an update is out of range: {error}") from error


def _named(numbers: bytes) -> dict[str, Any]:
    return dict(zip(UpdateMetrics.__struct_fields__, _NUMBERS.unpack(numbers), strict=True))


@dataclasses.dataclass(slots=True)
class CurvePoint:
    """The complete training bouts that ended while a stage had made ``update`` updates."""

    update: int
    """Updates of the stage so far, from 0."""
    total_samples: int
    """Samples both agents together had learned from, over the whole run."""
    at_ns: int
    """When the first of these bouts entered the ledger."""
    score: MutableSequence[float] = dataclasses.field(default_factory=lambda: array("d"))
    """The antagonist's total of each bout."""

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
    samples: int = 0
    """Learned from in this stage."""
    newest: VersionRecord | None = None
    """Of the versions the one with the highest number."""
    forgotten: int = 0
    """How many of the oldest versions are not in the list any more."""

    @property
    def updates(self) -> int:
        """Return how many updates were made in this stage."""
        return self.forgotten + len(self.versions) - self.restarts

    def add(self, record: VersionRecord) -> None:
        """Take in the next version made in this stage."""
        self.versions.append(record)
        self.samples += record.metrics.samples if record.metrics is not None else 0
        if self.newest is None or record.version > self.newest.version:
            self.newest = record

    def forget(self, count: int) -> list[VersionRecord]:
        """Let go of the oldest versions, and of the points before the others; return them."""
        gone = self.versions[:count]
        del self.versions[:count]
        del self.points[: -len(self.versions)]
        self.forgotten += len(gone)
        return gone

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
