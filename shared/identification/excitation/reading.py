"""Reads a programme of tool poses back, to be played: whole, unchanged, or not at all."""

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import msgspec
import numpy as np

from shared.config import toml
from shared.errors import IdentificationError
from shared.identification.dataset import checks
from shared.identification.dataset.manifest import FILE, read_manifest
from shared.identification.dataset.reading import NANO
from shared.identification.dataset.tables import MAX_BYTES, read_table
from shared.identification.dataset.types import POSE, Float64, Split
from shared.identification.excitation.motions import PERIOD
from shared.identification.excitation.writing import (
    COMMAND_FILE,
    PROGRAMME_FILE,
    PROGRAMME_SCHEMA,
)

REFERENCE: Final = "programme:"
"""What stands before a programme's identity where a player's reference stands."""

AT: Final = "@"
"""Between a recording's name and what makes the name of its bout its own."""


class _Recording(msgspec.Struct, frozen=True, kw_only=True):
    name: str
    sha256: str
    lead_m: float
    lead_rad: float


class _File(msgspec.Struct, frozen=True, kw_only=True):
    """``programme.toml``, as far as it is needed here."""

    schema: int
    recording: tuple[_Recording, ...]


@dataclass(frozen=True)
class Stretch:
    """One recording to play."""

    name: str
    split: Split
    repeats: str
    poses: Float64
    """float64[C, 7], of the tool in the torso frame, one every ``PERIOD``."""
    lead: float
    """Furthest that a pose is ahead of the nominal arm's tool (m)."""
    turn_lead: float
    """The same of the orientation (rad)."""

    @property
    def seconds(self) -> float:
        """Return how long it takes (s)."""
        return PERIOD * len(self.poses)


@dataclass(frozen=True)
class PosePlan:
    """A programme for an arm that is told tool poses: a PR2's."""

    folder: Path
    arm: Literal["right", "left"]
    stretches: tuple[Stretch, ...]
    digest: str
    """SHA-256 over all that is commanded, hex."""

    @property
    def reference(self) -> str:
        """Return what stands for it where a player's reference stands."""
        return f"{REFERENCE}{self.digest}"


def read_programme(folder: Path) -> PosePlan:
    """Return the programme in a folder that `riposte identify excite` wrote.

    Raises:
        IdentificationError: it is not there, was written by another version, was changed since,
            or is not for an arm that is told poses.
    """
    manifest = read_manifest(folder / FILE, _bytes(folder / FILE))
    if manifest.control != "pose" or manifest.model.kind != "pr2":
        raise IdentificationError(
            f"{folder} is for an arm under {manifest.control} control, a {manifest.model.kind}: "
            "robot_io plays poses of a PR2's tool; play it with that arm's own controller"
        )
    told = _told(folder / PROGRAMME_FILE)
    names = [each.name for each in manifest.trajectory]
    if names != [each.name for each in told.recording]:
        raise IdentificationError(
            f"{folder / PROGRAMME_FILE} and {FILE} name different recordings: design it again "
            "with riposte identify excite"
        )
    whole = hashlib.sha256()
    stretches: list[Stretch] = []
    for entry, recording in zip(manifest.trajectory, told.recording, strict=True):
        path = folder / entry.name / COMMAND_FILE
        data = _bytes(path)
        found = hashlib.sha256(data).hexdigest()
        if found != recording.sha256:
            raise IdentificationError(
                f"{path} was changed after the programme was designed (SHA-256 {found[:12]}, "
                f"expected {recording.sha256[:12]}): design it again with riposte identify excite"
            )
        whole.update(f"{entry.name}\0{entry.split}\0{entry.repeats}\0{found}\n".encode())
        poses = _poses(path, data)
        stretches.append(
            Stretch(
                entry.name, entry.split, entry.repeats, poses, recording.lead_m, recording.lead_rad
            )
        )
    return PosePlan(folder, manifest.model.arm, tuple(stretches), whole.hexdigest())


def _bytes(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAX_BYTES)
    except OSError as error:
        raise IdentificationError(
            f"cannot read {path}: {error.strerror}; a programme is a folder that riposte identify "
            "excite wrote"
        ) from None


def _told(path: Path) -> _File:
    try:
        told = toml.decode(_bytes(path), _File)
    except ValueError as error:
        raise IdentificationError(
            f"{path}: {error}; design the programme again with riposte identify excite"
        ) from None
    if told.schema != PROGRAMME_SCHEMA:
        raise IdentificationError(
            f"{path} has schema {told.schema}, this Riposte plays {PROGRAMME_SCHEMA}: design the "
            "programme again with riposte identify excite"
        )
    return told


def _poses(path: Path, data: bytes) -> Float64:
    """Return float64[C, 7]; poses come evenly, so that one is sent at every tick of the loop."""
    table = read_table(path, data, POSE.__contains__)
    checks.check_time(table)
    checks.require(table, POSE, "a command is a pose of the tool")
    at = (table.t_ns - table.t_ns[0]) / NANO
    if len(at) < 2 or float(np.abs(at - PERIOD * np.arange(len(at))).max()) > 1e-6:
        raise IdentificationError(
            f"{path} has not one pose every {PERIOD:g} s: design it again with riposte identify "
            "excite"
        )
    return np.stack([table.columns[name] for name in POSE], axis=1)
