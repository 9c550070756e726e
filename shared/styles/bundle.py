"""The bundle of a run: the protagonists to send to people, and where they come from.

A folder with ``bundle.toml`` and one snapshot file for each player, ``<sha256>.safetensors``, byte
for byte as in the run's store: the warm start and the selected three (paper, "Selecting agents with
distinct gameplay styles"). ``bundle.toml`` is written last and names every file by its hash, so a
reader sees the whole old bundle or the whole new one. Needs no library for statistics: ``riposte
play`` reads it.
"""

import contextlib
import hashlib
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import tomli_w

from shared.config import toml
from shared.errors import SnapshotError
from shared.policy.snapshot import MAX_BYTES, Snapshot, unpack
from shared.runtime.files import atomic_write

SCHEMA = 1
FILE = "bundle.toml"
_MAX_TOML = 1 << 20
_HEADING = """\
# Fencers to play against: where each comes from, and the hash of its file beside this one.
# Written by `riposte styles`, read by `riposte play`. The files are the run's snapshots, unchanged.

"""

Role = Literal["warm_start", "selected"]
Hash = Annotated[str, msgspec.Meta(pattern="^[0-9a-f]{64}$")]
Name = Annotated[str, msgspec.Meta(pattern="^[a-z0-9][a-z0-9_-]{0,39}$")]


class BundlePlayer(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One protagonist."""

    name: Name
    """What people call it on a command line: ``warm-start``, ``style-1``, ..."""
    role: Role
    round: int
    """Round of phase two that made it; 0 for the warm start."""
    seed: int
    """Of the training that made it."""
    sha256: Hash
    """Of its file, ``<sha256>.safetensors``."""
    style: dict[str, float] = {}
    """Mean of each feature over its bouts, by feature name."""
    spread: dict[str, float] = {}
    """Standard deviation of each from bout to bout."""

    @property
    def reference(self) -> str:
        """Return its player reference."""
        return f"sha256:{self.sha256}"


class Bundle(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What ``bundle.toml`` holds."""

    schema: int = SCHEMA
    run: str
    """Name of the run the players come from."""
    seed: int
    """Of that run."""
    trained_by: str
    """Command line that trains such a run."""
    selected_by: str
    """Command line that made this bundle."""
    commit: str
    """Of the code that made this bundle; empty outside a checkout."""
    criterion: str
    """What the selection maximised."""
    criterion_value: float
    """How much of it the three have."""
    bouts: int
    """Bouts of each protagonist that its style was measured on."""
    players: tuple[BundlePlayer, ...]

    def __post_init__(self) -> None:
        """Check that it can be played from."""
        names = [player.name for player in self.players]
        if twice := sorted({name for name in names if names.count(name) > 1}):
            raise ValueError(f"players have one name twice: {', '.join(twice)}")
        if [player.role for player in self.players].count("warm_start") > 1:
            raise ValueError("players have more than one warm_start")
        if not any(player.role == "selected" for player in self.players):
            raise ValueError("players have nobody selected")

    def player(self, name: str) -> BundlePlayer:
        """Return a player by name.

        Raises:
            SnapshotError: nobody has that name.
        """
        for player in self.players:
            if player.name == name:
                return player
        known = ", ".join(player.name for player in self.players)
        raise SnapshotError(f"the bundle has no player {name!r}; it has {known}")


class LoadedBundle(msgspec.Struct, frozen=True):
    """A bundle whose every file is there, whole and a protagonist's."""

    folder: Path
    bundle: Bundle
    snapshots: dict[str, Snapshot]
    """By player name, in the bundle's order."""


def save_bundle(folder: Path, bundle: Bundle, payloads: Mapping[str, bytes]) -> None:
    """Write a bundle; files of an older one in the folder go once the new one is in place.

    Args:
        folder: made if it is not there.
        bundle: what to write.
        payloads: the snapshot file of each player, by SHA-256.

    Raises:
        SnapshotError: a file is missing or not what its hash says.
        RiposteError: it cannot be written; an older bundle in the folder is intact.
    """
    for player in bundle.players:
        payload = payloads.get(player.sha256, b"")
        if hashlib.sha256(payload).hexdigest() != player.sha256:
            raise SnapshotError(f"the file of {player.name} is not snapshot {player.sha256[:12]}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise SnapshotError(
            f"bundle folder {folder} cannot be made ({error.strerror}); make it writable"
        ) from error
    files = {f"{player.sha256}.safetensors": payloads[player.sha256] for player in bundle.players}
    for name, payload in files.items():
        atomic_write(folder / name, payload)
    text = _HEADING + tomli_w.dumps(msgspec.to_builtins(bundle))
    atomic_write(folder / FILE, text.encode())
    for old in folder.glob("*.safetensors"):
        if old.name not in files:
            with contextlib.suppress(OSError):
                old.unlink()


def load_bundle(folder: Path) -> LoadedBundle:
    """Return the bundle in a folder, checked to the last file.

    Raises:
        SnapshotError: there is none, it is damaged, or a file is missing, another one or not a
            protagonist's; says which.
    """
    path = folder / FILE
    try:
        with path.open("rb") as file:
            text = file.read(_MAX_TOML)
    except OSError as error:
        raise SnapshotError(
            f"{folder} holds no bundle ({FILE}: {error.strerror}); "
            "make one with: riposte styles RUN"
        ) from None
    bundle = _decode(text, path)
    snapshots = {player.name: _read(folder, player) for player in bundle.players}
    return LoadedBundle(folder, bundle, snapshots)


def shipped_bundle() -> Path:
    """Return the folder of the bundle that came with this installation.

    Raises:
        SnapshotError: none came with it.
    """
    folder = Path(str(resources.files("shared.styles") / "data" / "bundle"))
    if not (folder / FILE).is_file():
        raise SnapshotError(
            "no bundle came with this installation; make one with: "
            "riposte train --phase all, riposte tournament RUN, riposte styles RUN"
        )
    return folder


def _decode(text: bytes, path: Path) -> Bundle:
    try:
        version = toml.parse(text).get("schema")
        if version != SCHEMA:
            raise SnapshotError(f"{path} has schema {version}, this build reads schema {SCHEMA}")
        return toml.decode(text, Bundle)
    except ValueError as error:
        raise SnapshotError(
            f"{path} is no bundle: {error}; write it again with: riposte styles RUN"
        ) from None


def _read(folder: Path, player: BundlePlayer) -> Snapshot:
    path = folder / f"{player.sha256}.safetensors"
    try:
        with path.open("rb") as file:
            payload = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise SnapshotError(
            f"bundle {folder} has no file for {player.name} ({path.name}: {error.strerror}); "
            "copy the whole folder again"
        ) from None
    found = hashlib.sha256(payload).hexdigest()
    if found != player.sha256:
        raise SnapshotError(
            f"bundle {folder}: the file of {player.name} is damaged (its hash is {found[:12]}, "
            f"not {player.sha256[:12]}); copy the folder again"
        )
    snapshot = unpack(payload)
    if snapshot.card.agent != "protagonist":
        raise SnapshotError(
            f"bundle {folder}: {player.name} is the {snapshot.card.agent}'s policy, "
            "a bundle holds protagonists"
        )
    return snapshot
