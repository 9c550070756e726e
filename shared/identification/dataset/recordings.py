"""The tables of one trajectory: found, read, and their columns told apart."""

import hashlib
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, get_args

from shared.config.site import nearest
from shared.errors import IdentificationError
from shared.identification.dataset import checks
from shared.identification.dataset.manifest import Manifest, ModelTable
from shared.identification.dataset.tables import MAX_BYTES, TIME, Table, read_table
from shared.identification.dataset.types import POSE, Float64
from shared.sim.config import JointName

PR2_JOINTS: Final[tuple[str, ...]] = get_args(JointName)
"""Of an arm, shoulder to wrist, as the simulator calls them."""
SUFFIXES: Final = (".parquet", ".csv")
MAX_TOTAL_BYTES: Final = 1 << 30
"""Of all files together."""
MAX_TOTAL_CELLS: Final = 64_000_000
"""Numbers of all tables together; 8 bytes each."""

_JOINT_COLUMN = re.compile(r"(?P<kind>q|qd|effort)_(?P<joint>.+)\Z", re.DOTALL)
_URDF_NAME = re.compile(r"(?P<side>[rl])_(?P<joint>\w+)_joint\Z")

Columns = dict[str, dict[str, Float64]]
"""float64[T] by kind (``q``, ``qd``, ``effort``) and joint."""


class Files:
    """Reads files whole, counts what was read, and hashes it."""

    def __init__(self) -> None:
        self._bytes = 0
        self._cells = 0
        self._hash = hashlib.sha256()

    @property
    def hash(self) -> str:
        """Return the SHA-256 of all files read, their names and lengths between them."""
        return self._hash.hexdigest()

    def read(self, path: Path) -> bytes:
        """Return a file's bytes.

        Raises:
            IdentificationError: it is not there, cannot be read, or is too large.
        """
        try:
            if not path.is_file():
                what = "is no file" if path.exists() else "is missing"
                raise IdentificationError(f"{path} {what}; docs/dataset.md says what belongs there")
            size = path.stat().st_size
            self._bytes += size
            if size > MAX_BYTES or self._bytes > MAX_TOTAL_BYTES:
                raise IdentificationError(
                    f"{path} has {size >> 20} MiB; at most {MAX_BYTES >> 20} MiB a file and "
                    f"{MAX_TOTAL_BYTES >> 20} MiB a data set are read: thin the recordings out"
                )
            with path.open("rb") as file:
                data = file.read(MAX_BYTES)
        except (OSError, ValueError) as error:  # ValueError: a name with a zero byte
            raise IdentificationError(f"cannot read {path}: {error}") from None
        self._hash.update(f"{path.name}\0{len(data)}\0".encode())
        self._hash.update(data)
        return data

    def table(self, folder: Path, name: str, wanted: Callable[[str], bool]) -> Table:
        """Return ``name.parquet`` or ``name.csv`` of a folder; its times rise.

        Raises:
            IdentificationError: it is not there or not usable, or there is too much in all.
        """
        there = [path for suffix in SUFFIXES if (path := folder / f"{name}{suffix}").exists()]
        if len(there) > 1:
            raise IdentificationError(f"{there[0]} and {there[1]} are both there: remove one")
        if not there:
            raise IdentificationError(
                f"{folder / name}.parquet is missing (or {name}.csv): every trajectory has a "
                "folder of its name with command and joints in it"
            )
        table = read_table(there[0], self.read(there[0]), wanted)
        self._cells += len(table.t_ns) * (1 + len(table.columns))
        if self._cells > MAX_TOTAL_CELLS:
            raise IdentificationError(
                f"{table.path} and the tables before it have {self._cells} numbers, at most "
                f"{MAX_TOTAL_CELLS} are read: leave trajectories out, or thin them out"
            )
        checks.check_time(table)
        return table


@dataclass(frozen=True)
class Recording:
    """The tables of one trajectory."""

    command: Table
    readings: Table
    tracker: Table | None
    actuators: tuple[str, ...]
    columns: Columns
    """Of the readings."""
    ignored: tuple[str, ...]
    """``file: column`` of what is not used."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Return whose positions were read, in the file's order."""
        return tuple(self.columns["q"])


def read_recording(folder: Path, manifest: Manifest, files: Files) -> Recording:
    """Return the tables in a trajectory's folder.

    Raises:
        IdentificationError: one is missing or unusable, or they do not overlap in time.
    """
    is_pose = manifest.control == "pose"

    def is_of_command(name: str) -> bool:
        return not is_pose or name in POSE

    command = files.table(folder, "command", is_of_command)
    if is_pose:
        checks.require(command, POSE, "a command is a pose of the tool")
    elif not command.columns:
        raise IdentificationError(f"{command.path} has no column of an actuator beside {TIME!r}")
    readings = files.table(folder, "joints", _is_of_joint)
    columns, unused = _joint_columns(readings, manifest.model)
    checks.check_overlap(command, readings)
    tracker = None
    if any((folder / f"tracker{suffix}").exists() for suffix in SUFFIXES):
        tracker = files.table(folder, "tracker", POSE.__contains__)
    ignored = [
        f"{table.path.name}: {column}"
        for table in (command, readings, tracker) if table is not None
        for column in table.others
    ]  # fmt: skip
    ignored += [f"{readings.path.name}: {column}" for column in unused]
    actuators = POSE if is_pose else tuple(command.columns)
    return Recording(command, readings, tracker, actuators, columns, tuple(ignored))


def joint_named(name: str, model: ModelTable) -> str:
    """Return the simulator's name of a joint; empty where a PR2's arm has no such joint.

    Those of a PR2 may be named as on the robot, ``r_elbow_flex_joint``.
    """
    if model.kind != "pr2" or name in PR2_JOINTS:
        return name
    match = _URDF_NAME.match(name)
    is_ours = match and match["side"] == model.arm[0] and match["joint"] in PR2_JOINTS
    return match["joint"] if match and is_ours else ""


def _is_of_joint(name: str) -> bool:
    return _JOINT_COLUMN.match(name) is not None


def _joint_columns(table: Table, model: ModelTable) -> tuple[Columns, list[str]]:
    """Return the columns by kind and joint, and those of no joint of the model."""
    found: Columns = {"q": {}, "qd": {}, "effort": {}}
    unused: list[str] = []
    for name, values in table.columns.items():
        match = _JOINT_COLUMN.match(name)
        if match is None:
            continue
        joint = joint_named(match["joint"], model)
        if not joint:
            unused.append(name)
        elif joint in found[match["kind"]]:
            raise IdentificationError(f"{table.path} has {match['kind']} of {joint!r} twice")
        else:
            found[match["kind"]][joint] = values
    if model.kind == "pr2":
        for joint in PR2_JOINTS:
            checks.require_one(
                table, found["q"], joint, (f"q_{joint}", f"q_{model.arm[0]}_{joint}_joint"),
            )  # fmt: skip
    elif not found["q"]:
        checks.require(table, ("q_<joint>",), "a position per joint")
    for kind in ("qd", "effort"):
        for joint in found[kind]:
            if joint not in found["q"]:
                alone = [each for each in found["q"] if each not in found[kind]]
                advice = f"it has q of {', '.join(found['q'])}: log it, or leave the column out"
                raise IdentificationError(
                    f"{table.path} has column '{kind}_{joint}' but no 'q_{joint}'; "
                    + (nearest(joint, alone) if alone else advice)
                )
    return found, unused
