"""``dataset.toml``: which recordings there are, of which model, under which control."""

import math
import re
from pathlib import Path
from typing import Any, Final, Literal

import msgspec

from shared.config import toml
from shared.config.located import read_toml
from shared.config.site import nearest
from shared.errors import ConfigError, IdentificationError
from shared.identification.dataset.types import Control, EncoderSide, Kind, Split

FILE: Final = "dataset.toml"
SCHEMA: Final = 1
MAX_BYTES: Final = 1 << 20
MAX_TRAJECTORIES: Final = 200

_NAME = re.compile(r"\w[\w.-]{0,99}\Z", re.ASCII)


class ModelTable(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """``[model]``: the simulation that the recordings are compared with."""

    kind: Kind
    path: str = ""
    """The MJCF file, from the data set's folder; only of ``kind = "mjcf"``."""
    arm: Literal["right", "left"] = "right"
    """Only of ``kind = "pr2"``."""
    parameters: str = ""
    """A ``model.toml``, from the data set's folder; only of ``kind = "pr2"``."""
    tracked: str = ""
    """Site or body that the tracker is fixed to; only of ``kind = "mjcf"``."""
    encoders: EncoderSide | None = None
    """Which side of the joints' gears was logged; only of ``kind = "mjcf"``."""

    def __post_init__(self) -> None:
        """Refuse what belongs to the other kind."""
        if self.kind == "mjcf":
            if not self.path:
                raise ValueError('kind = "mjcf" needs path, the MJCF file')
            if self.parameters or self.arm != "right":
                raise ValueError('arm and parameters belong to kind = "pr2": take them out')
        elif self.path or self.tracked or self.encoders:
            raise ValueError('path, tracked and encoders belong to kind = "mjcf": take them out')


class TrajectoryTable(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A ``[[trajectory]]``: one recording, in the folder of its name."""

    name: str
    split: Split
    repeats: str = ""
    """Name of the trajectory whose commands this one repeats."""
    initial: dict[str, float] | None = None
    """Position by joint (rad, m) at time 0; the first reading where it is not given."""
    initial_velocity: dict[str, float] | None = None
    """Velocity by joint (rad/s, m/s) at time 0."""

    def __post_init__(self) -> None:
        """Refuse a name that is no folder's, and numbers that are none."""
        if not _NAME.match(self.name):
            raise ValueError(
                f"name {self.name!r} is not made of letters, digits, '_', '-' and '.', up to 100 "
                "of them: it is the name of a folder, too"
            )
        for key in ("initial", "initial_velocity"):
            table: dict[str, float] = getattr(self, key) or {}
            for joint, value in table.items():
                if not math.isfinite(value):
                    raise ValueError(f"{key} of joint {joint!r} is {value}, expected a number")


class Manifest(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All of ``dataset.toml``."""

    schema: int
    control: Control
    model: ModelTable
    trajectory: tuple[TrajectoryTable, ...]
    continuous: tuple[str, ...] = ()
    """Joints that may turn without end: their angles may be large."""
    generator: dict[str, Any] = {}
    """Who wrote it, free; not read."""


def read_manifest(path: Path, data: bytes) -> Manifest:
    """Return what a ``dataset.toml`` says.

    Args:
        path: of the file, for the errors' text.
        data: its bytes.

    Raises:
        IdentificationError: it is no TOML, of another schema, has an unknown key or a value that
            cannot be, or its trajectories do not fit together; names the line where it is known.
    """
    text, tables = _parse(path, data)
    schema = tables.get("schema")
    if type(schema) is not int or schema != SCHEMA:
        raise IdentificationError(
            f"{path}: schema is {schema!r}, this Riposte reads {SCHEMA}: write schema = {SCHEMA} "
            "at the top, and the rest as docs/dataset.md says"
        )
    try:
        manifest = read_toml(text.encode(), str(path), Manifest)
    except ConfigError as error:
        raise IdentificationError(str(error)) from None
    _check_trajectories(path, manifest)
    return manifest


def _parse(path: Path, data: bytes) -> tuple[str, dict[str, Any]]:
    if len(data) > MAX_BYTES:
        raise IdentificationError(
            f"{path} has {len(data)} bytes, at most {MAX_BYTES} are read: "
            "numbers belong into the tables beside it"
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise IdentificationError(f"{path} is not UTF-8 text ({error})") from None
    try:
        return text, toml.parse(text)
    except ValueError as error:
        raise IdentificationError(f"{path}: not TOML: {error}") from None


def _check_trajectories(path: Path, manifest: Manifest) -> None:
    entries = manifest.trajectory
    if len(entries) > MAX_TRAJECTORIES:
        raise IdentificationError(
            f"{path} names {len(entries)} trajectories, at most {MAX_TRAJECTORIES} are read"
        )
    names = [each.name for each in entries]
    for each in entries:
        if names.count(each.name) > 1:
            raise IdentificationError(
                f"{path}: {names.count(each.name)} trajectories are called {each.name!r}: "
                "give each its own name"
            )
        if each.repeats and (each.repeats not in names or each.repeats == each.name):
            others = [name for name in names if name != each.name]
            raise IdentificationError(
                f"{path}: trajectory {each.name!r} repeats {each.repeats!r}, which is no other "
                f"trajectory of this data set; {nearest(each.repeats, others)}"
            )
    for split, use in (("train", "to fit to"), ("test", "to hold out")):
        if not any(each.split == split for each in entries):
            raise IdentificationError(
                f'{path}: no trajectory has split = "{split}": at least one is needed {use}'
            )
