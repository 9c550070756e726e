"""Compares what was acknowledged with what the ledger holds, name by name.

An actor logs the name of each rollout and each results message when its acknowledgement arrives;
the ledger names the rollouts behind every version and every results message. What was
acknowledged and is not there was lost; what is there twice was applied twice.
"""

import hashlib
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from services.league.events import BoutsPlayed, Event, LeaseGranted, VersionEntered
from shared.errors import SnapshotError
from shared.policy.snapshot import unpack


class Toll(msgspec.Struct, frozen=True, kw_only=True):
    """What must not be, counted; all zero where everything held."""

    lost: int = 0
    """Acknowledged rollouts and results that the ledger does not have."""
    twice: int = 0
    """Rollouts, results and bouts that it has more than once."""
    bad_snapshots: int = 0
    """Versions it holds whose snapshot is missing, or is not what its hash says, or no policy."""
    lies: int = 0
    """Forged rollouts that were learned from, and forged snapshots that were entered."""

    @property
    def is_none(self) -> bool:
        """Return whether nothing was harmed."""
        return self == Toll()

    def since(self, before: "Toll") -> "Toll":
        """Return what has been added to an earlier count."""
        return Toll(
            **{name: getattr(self, name) - getattr(before, name) for name in self.__struct_fields__}
        )


class Books:
    """Both sides of one run's ledger."""

    def __init__(self) -> None:
        """Know of nothing."""
        self.acknowledged: set[str] = set()
        """Rollouts that actors were told are durable."""
        self.results_acknowledged: set[str] = set()
        self.forged: set[str] = set()
        """Names of rollouts, and hashes of snapshots, that were made up."""
        self.refused: Counter[str] = Counter()
        """Lies by kind that were answered with a refusal, or with nothing."""
        self.told: Counter[str] = Counter()
        """Lies by kind that were told."""
        self.believed: Counter[str] = Counter()
        """Lies by kind that were answered as the truth is."""
        self.policies_refused = 0
        """Announced policies that actors would not use."""
        self._learned: Counter[str] = Counter()
        self._results: Counter[str] = Counter()
        self._bouts: Counter[tuple[str, int]] = Counter()
        self._training: set[str] = set()
        self._snapshots: dict[str, bool] = {}
        """By hash, whether the file is what it should be."""

    def hear(self, event: Mapping[str, Any]) -> None:
        """Take a line of an actor's log."""
        match event.get("event"):
            case "rollout_acknowledged":
                self.acknowledged.add(event["name"])
            case "results_acknowledged":
                self.results_acknowledged.add(event["name"])
            case "lie_told":
                self.told[event["lie"]] += 1
                if event["is_forged"]:
                    self.forged.add(event["name"])
            case "lie_refused" | "lie_accepted" as how:
                (self.refused if how == "lie_refused" else self.believed)[event["lie"]] += 1
            case "policy_refused":
                self.policies_refused += 1
            case _:
                pass

    def enter(self, event: Event, snapshots: Path) -> None:
        """Take an event of the ledger.

        Args:
            event: the next one.
            snapshots: folder of the run's snapshots.
        """
        match event:
            case VersionEntered():
                self._learned.update(event.rollouts)
                if event.snapshot not in self._snapshots:
                    self._snapshots[event.snapshot] = _is_whole(snapshots, event.snapshot)
            case BoutsPlayed():
                self._results[event.name] += 1
                if event.lease in self._training:
                    self._bouts.update((event.lease, bout) for bout in event.bouts)
            case LeaseGranted(work="train"):
                self._training.add(event.lease)
            case _:
                pass

    @property
    def toll(self) -> Toll:
        """Return the count so far; every line logged before the ledger was read is in it."""
        lost = self.acknowledged - self._learned.keys()
        lost_results = self.results_acknowledged - self._results.keys()
        counts = (self._learned, self._results, self._bouts)
        known = self._learned.keys() | self._snapshots.keys()
        return Toll(
            lost=len(lost) + len(lost_results),
            twice=sum(times - 1 for counter in counts for times in counter.values()),
            bad_snapshots=sum(not is_whole for is_whole in self._snapshots.values()),
            lies=len(self.forged & known),
        )

    @property
    def size(self) -> int:
        """Return how many acknowledged names were compared."""
        return len(self.acknowledged) + len(self.results_acknowledged)


def _is_whole(folder: Path, digest: str) -> bool:
    try:
        payload = (folder / f"{digest}.safetensors").read_bytes()
        unpack(payload, digest)
    except (OSError, SnapshotError):
        return False
    return hashlib.sha256(payload).hexdigest() == digest
