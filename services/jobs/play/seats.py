"""Who sits on the two sides of a live bout: what people call a player, made exact and checked."""

import contextlib
import importlib.util
from collections.abc import Mapping
from pathlib import Path
from typing import Final

import msgspec

from services.policy.loading import Loader
from shared.errors import SnapshotError
from shared.messages.training import AGENTS, Agent
from shared.policy.players import SCRIPTED_PREFIX
from shared.policy.snapshot import digest_of
from shared.styles.bundle import Bundle, load_bundle, shipped_bundle

PERSON: Final = "person"
"""Reference of whoever holds a tracked bat."""
TRACKERS: Final = ("mouse", "vive", "replay")
"""Antagonists whose bat is tracked."""
HEURISTICS: Final[Mapping[Agent, str]] = {
    "antagonist": "scripted:stab",
    "protagonist": "scripted:heuristic",
}
"""What ``heuristic`` means on each side."""
_DIGEST_PREFIX = "sha256:"


class Seat(msgspec.Struct, frozen=True, kw_only=True):
    """One side, filled."""

    label: str
    """For people: ``style-1``, ``scripted:stab``, ``mouse``."""
    reference: str
    """For the record: ``sha256:HASH``, ``scripted:NAME`` or ``person``."""
    player: str = ""
    """What a policy process is told to load; empty where a person plays."""

    @property
    def is_person(self) -> bool:
        """Return whether no policy plays here."""
        return not self.player


def seat_of(text: str, loader: Loader, runs: Path) -> Seat:
    """Return the seat that a text names, its player loaded once to see that it fits.

    Args:
        text: as in section ``[play]``.
        loader: of the side.
        runs: folder of runs in which ``sha256:HASH`` is looked for.

    Raises:
        SnapshotError: there is no such player, or it does not fit: names the field.
    """
    agent = loader.agent
    if agent == "antagonist" and text in TRACKERS:
        return Seat(label=text, reference=PERSON)
    if text in ("heuristic", "scripted"):
        text = HEURISTICS[agent]
    label, player = text, text
    if agent == "protagonist" and (found := _of_bundle(text)) is not None:
        label, path = found
        player = str(path)
    elif text.startswith(_DIGEST_PREFIX):
        player = str(_file_of(digest_of(text), runs))
    elif not text.startswith(SCRIPTED_PREFIX):
        player = _absolute(text)
    named = loader.load(player)
    run, _, side = player.rpartition(":")
    if run and side in AGENTS and named.reference.startswith(_DIGEST_PREFIX):
        # The newest of a run that still trains may be another one a second later.
        digest = digest_of(named.reference)
        player = str(Path(run) / "snapshots" / f"{digest}.safetensors")
    if label.startswith(_DIGEST_PREFIX):
        label = label[: len(_DIGEST_PREFIX) + 12]
    return Seat(label=label, reference=named.reference, player=player)


def missing_library(antagonist: Seat, link: str) -> str | None:
    """Return the optional library that the match needs and that is not installed."""
    needed = {"mouse": "websockets", "vive": "openvr"}
    wanted = [needed[antagonist.label]] if antagonist.label in needed else []
    wanted += ["rosbags"] if link == "pr2" else []
    return next((name for name in wanted if importlib.util.find_spec(name) is None), None)


def _of_bundle(text: str) -> tuple[str, Path] | None:
    """Return name and file of a player of the shipped bundle; None where the text names none.

    Raises:
        SnapshotError: it is asked for, and there is no bundle or it is damaged.
    """
    if text and (":" in text or "/" in text or Path(text).exists()):
        return None
    try:
        loaded = load_bundle(shipped_bundle())
    except SnapshotError as error:
        if text:  # it may have meant a file, which the loader will not find
            return None
        raise SnapshotError(f"no protagonist is named, and {error}") from None
    name = text or _first_selected(loaded.bundle)
    names = [player.name for player in loaded.bundle.players]
    if name not in names:
        known = ", ".join(names)
        raise SnapshotError(
            f"there is no player {name!r}: say heuristic, scripted:NAME, one of the bundle "
            f"({known}), a .safetensors file, RUN:protagonist or sha256:HASH"
        )
    return name, loaded.folder / f"{loaded.bundle.player(name).sha256}.safetensors"


def _first_selected(bundle: Bundle) -> str:
    return next(player.name for player in bundle.players if player.role == "selected")


def _file_of(digest: str, runs: Path) -> Path:
    """Return the file of a snapshot among those of the bundle and of all runs.

    Raises:
        SnapshotError: nobody has it.
    """
    name = f"{digest}.safetensors"
    folders = [path / "snapshots" for path in sorted(runs.glob("*")) if not path.is_symlink()]
    with contextlib.suppress(SnapshotError):
        folders.insert(0, shipped_bundle())
    for folder in folders:
        if (folder / name).is_file():
            return (folder / name).resolve()
    raise SnapshotError(
        f"no run in {runs} holds snapshot {digest[:12]}, nor does the bundle; "
        "name its file, or copy the run there"
    )


def _absolute(text: str) -> str:
    """Return a path, or ``RUN:AGENT``, that means the same in every working directory."""
    run, _, side = text.rpartition(":")
    if run and side in AGENTS:
        return f"{Path(run).resolve()}:{side}"
    return str(Path(text).resolve())
