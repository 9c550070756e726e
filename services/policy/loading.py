"""Finds the player that a reference names, and refuses one that does not fit this process."""

import dataclasses
import os
import re
import stat
from pathlib import Path

from shared.errors import SnapshotError
from shared.messages.training import AGENTS, Agent
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import SCRIPTED_PREFIX, Player, SnapshotPlayer, scripted_player
from shared.policy.scripted.sight import Arena
from shared.policy.snapshot import MAX_BYTES, Fit, Snapshot, digest_of, unpack

_DIGEST_PREFIX = "sha256:"
_HASH = re.compile("[0-9a-f]{64}")
"""Name of a file that says what its bytes must be."""


@dataclasses.dataclass(frozen=True)
class NamedPlayer:
    """A player and how it is known."""

    reference: str
    """``scripted:<name>`` or ``sha256:<hash>``: the same player for ever."""
    player: Player


@dataclasses.dataclass(frozen=True)
class Loader:
    """Loads the players of one side."""

    agent: Agent
    fit: Fit
    arena: Arena
    run: Path
    """Folder of this run, in which ``sha256:`` references are looked up."""
    listed: frozenset[str] = frozenset()
    """What a settings file names as players: what may be asked for over the bus by its path."""

    def load(self, text: str) -> NamedPlayer:
        """Return the player that a text names.

        Args:
            text: ``scripted:NAME``, the file of a snapshot, ``RUN:antagonist`` or
                ``RUN:protagonist`` (the newest version in a run's folder), or ``sha256:HASH``.

        Raises:
            SnapshotError: there is none, it is damaged, or it does not fit: names the field.
        """
        if text.startswith(SCRIPTED_PREFIX):
            return NamedPlayer(text, scripted_player(text, self.arena))
        return self._fitting(self._find(text))

    def _fitting(self, snapshot: Snapshot) -> NamedPlayer:
        """Return a snapshot's player, if this side may be played by it."""
        if snapshot.card.agent != self.agent:
            raise SnapshotError(
                f"snapshot {snapshot.digest[:12]} does not fit here: its agent is "
                f"{snapshot.card.agent}, this process plays the {self.agent}"
            )
        snapshot.check_fits(self.fit)
        policy = GaussianPolicy(snapshot.weights)
        return NamedPlayer(snapshot.reference, SnapshotPlayer(policy, stochastic=False))

    def load_asked(self, text: str) -> NamedPlayer:
        """Return the player that somebody on the bus names.

        Who is on the network may choose among players, not among this machine's files: whether a
        file is there cannot be told from the answer.

        Args:
            text: ``scripted:NAME``, ``sha256:HASH`` of a snapshot that this run has or that is
                listed, or a text that is listed.

        Raises:
            SnapshotError: it is none of these, it is damaged, or it does not fit.
        """
        if text.startswith(SCRIPTED_PREFIX) or (text and text in self.listed):
            return self.load(text)
        if text.startswith(_DIGEST_PREFIX):
            digest = digest_of(text)
            if found := self._known_file(f"{digest}.safetensors"):
                return self._fitting(unpack(_read(Path(found)), digest))
        raise SnapshotError(
            f"there is no player {text[:80]!r} to be had over the bus: ask for scripted:NAME, "
            "sha256:HASH of a snapshot in this run's folder, or one that [policy], "
            "[page] players or [study] players of this process's settings names"
        )

    def _known_file(self, name: str) -> str:
        """Return the path of a snapshot file among those of this run and those listed, or ""."""
        listed = (Path(text) for text in sorted(self.listed) if text.endswith(f"/{name}"))
        kept = (self.run / "snapshots" / name, *listed)
        return next((str(path) for path in kept if path.is_file()), "")

    def _find(self, text: str) -> Snapshot:
        if text.startswith(_DIGEST_PREFIX):
            digest = digest_of(text)
            return unpack(_read(self.run / "snapshots" / f"{digest}.safetensors"), digest)
        run, _, agent = text.rpartition(":")
        for known in AGENTS:
            if run and agent == known:
                return _newest(Path(run), known)
        path = Path(text)
        return unpack(_read(path), path.stem if _HASH.fullmatch(path.stem) else None)


def _newest(run: Path, agent: Agent) -> Snapshot:
    """Return the version of an agent with the highest number in a run's folder."""
    found: Snapshot | None = None
    for path in sorted((run / "snapshots").glob("*.safetensors")):
        snapshot = unpack(_read(path), path.stem)
        if snapshot.card.agent == agent and (
            found is None or snapshot.card.policy_version > found.card.policy_version
        ):
            found = snapshot
    if found is None:
        raise SnapshotError(
            f"{run} holds no snapshot of the {agent} (in {run / 'snapshots'}); "
            "give the folder of a run that has trained"
        )
    return found


def _read(path: Path) -> bytes:
    try:
        with open(path, "rb", opener=_open) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                raise ValueError("no regular file")
            return file.read(MAX_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: no file, or a path with a zero byte
        reason = error.strerror if isinstance(error, OSError) else str(error)
        raise SnapshotError(
            f"snapshot {path} cannot be read ({reason}); give scripted:NAME, a .safetensors file, "
            "RUN:antagonist, RUN:protagonist or sha256:HASH"
        ) from None


def _open(path: str, flags: int) -> int:
    """Open without waiting: a FIFO would stop this process, and the robot with it."""
    return os.open(path, flags | os.O_NONBLOCK)
