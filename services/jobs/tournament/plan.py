"""Who meets whom in a tournament: the players of a run, scripted ones, and others by name."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import msgspec

from services.league.events import EvaluationPlanned, Pairing
from services.league.history import RunState
from services.league.snapshots import SnapshotStore
from shared.errors import ConfigError, SnapshotError
from shared.messages.training import AGENTS, Agent
from shared.policy.players import (
    SCRIPTED_PLAYERS,
    SCRIPTED_PREFIX,
    scripted_player,
    scripted_role,
)
from shared.policy.snapshot import MAX_BYTES, Fit, unpack

MOST_PLAYERS = 256
"""On one side."""


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """What a tournament is of: ``plan.json`` in its folder."""

    run: str
    """Name of the run whose players meet."""
    antagonists: tuple[str, ...]
    protagonists: tuple[str, ...]
    """Player references."""
    labels: dict[str, str]
    """Short names, by reference."""
    bouts: int
    """Of each pairing."""
    commit: str

    @property
    def event(self) -> EvaluationPlanned:
        """Return the plan as the ledger has it."""
        return EvaluationPlanned(
            plan=0,
            pairings=tuple(
                Pairing(antagonist=antagonist, protagonist=protagonist, bouts=self.bouts)
                for antagonist in self.antagonists
                for protagonist in self.protagonists
            ),
        )


@dataclasses.dataclass
class Pools:
    """The players of both sides, each once, with their names and snapshots."""

    run: Path
    fit: Fit
    players: dict[Agent, list[str]] = dataclasses.field(
        default_factory=lambda: {agent: [] for agent in AGENTS}
    )
    labels: dict[str, str] = dataclasses.field(default_factory=dict[str, str])
    payloads: dict[str, bytes] = dataclasses.field(default_factory=dict[str, bytes])
    """Of the snapshots, by content hash."""

    def add_library(self, state: RunState) -> None:
        """Add the warm-start pair and each round's; before phase two, all that came of a stage.

        Raises:
            SnapshotError: a snapshot is missing, damaged, or not made for this run's settings.
        """
        warm, library = state.warm_start(), state.library()
        if warm is None or not library:
            for agent in AGENTS:
                for record in state.stage_ends(agent):
                    self._add_snapshot(record.end_ref, record.end_label, agent)
            return
        for agent, ref in zip(AGENTS, warm, strict=True):
            self._add_snapshot(ref, f"{agent} warm start", agent)
        for number, *pair in library:
            for agent, ref in zip(AGENTS, pair, strict=True):
                self._add_snapshot(ref, f"{agent} round {number}", agent)

    def add_scripted(self) -> None:
        """Add every scripted player to its side."""
        for name in SCRIPTED_PLAYERS:
            self.add(SCRIPTED_PREFIX + name)

    def add(self, reference: str) -> None:
        """Add a player to the side it plays.

        Args:
            reference: ``scripted:<name>``, ``sha256:<hash>`` of the run, or a snapshot file.

        Raises:
            ConfigError: there is no such file.
            SnapshotError: there is no such player, or it does not fit.
        """
        if reference.startswith(SCRIPTED_PREFIX):
            scripted_player(reference)  # refuses an unknown one
            name = reference.removeprefix(SCRIPTED_PREFIX)
            self._enter(scripted_role(name), reference, name)
        elif reference.startswith("sha256:"):
            self._add_snapshot(reference)
        else:
            self._add_file(Path(reference))

    def plan(self, run: str, bouts: int, commit: str) -> Plan:
        """Return the tournament of everybody against everybody of the other side.

        Raises:
            ConfigError: a side has nobody, or too many.
        """
        for agent in AGENTS:
            count = len(self.players[agent])
            if not count:
                raise ConfigError(
                    f"{self.run} has no {agent} that came out of a stage yet; train it on with "
                    "riposte train --resume, or add players with --players"
                )
            if count > MOST_PLAYERS:
                raise ConfigError(f"{count} {agent}s are too many; at most {MOST_PLAYERS} can meet")
        return Plan(
            run=run,
            antagonists=tuple(self.players["antagonist"]),
            protagonists=tuple(self.players["protagonist"]),
            labels=self.labels,
            bouts=bouts,
            commit=commit,
        )

    def _add_snapshot(self, reference: str, label: str = "", agent: Agent | None = None) -> None:
        self._add_payload(SnapshotStore(self.run / "snapshots").get(reference), label, agent)

    def _add_file(self, path: Path) -> None:
        try:
            with path.open("rb") as file:
                payload = file.read(MAX_BYTES + 1)
        except OSError as error:
            raise ConfigError(
                f"--players {path}: {error.strerror}; expected scripted:<name>, sha256:<hash> of a "
                "snapshot of the run, or a snapshot file"
            ) from None
        try:
            self._add_payload(payload, path.stem if len(path.stem) < 40 else "")
        except SnapshotError as error:
            raise SnapshotError(f"--players {path}: {error}") from None

    def _add_payload(self, payload: bytes, label: str, agent: Agent | None = None) -> None:
        snapshot = unpack(payload)
        snapshot.check_fits(self.fit)
        card = snapshot.card
        if agent is not None and card.agent != agent:
            raise SnapshotError(
                f"snapshot {snapshot.digest[:12]} is of the {card.agent}, the ledger has it as "
                f"{agent}; the ledger is of another run"
            )
        self.payloads[snapshot.digest] = payload
        self._enter(card.agent, snapshot.reference, label)

    def _enter(self, agent: Agent, reference: str, label: str) -> None:
        if reference not in self.players[agent]:
            self.players[agent].append(reference)
            if label:
                self.labels[reference] = label


def batch_size(bouts: int, most: int) -> int:
    """Return how many bouts an actor plays at once, so that a pairing is cut into equal parts."""
    return -(-bouts // -(-bouts // most))


def check_asked(state: RunState, asked: Sequence[tuple[str, int | None, int]]) -> None:
    """Refuse to continue a tournament that is not the one asked for.

    Args:
        state: of the tournament's ledger.
        asked: option, what it says (None: nothing), what the tournament was begun with.

    Raises:
        ConfigError: names the option.
    """
    for option, wanted, begun in asked:
        if wanted is not None and wanted != begun:
            raise ConfigError(
                f"this tournament was begun with {option} {begun}, not {wanted}; leave {option} "
                f"out to continue it, or choose another folder with --out "
                f"({state.evaluation_done} of {state.evaluation_total} bouts are played)"
            )
