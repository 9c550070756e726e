"""Reads a data set from its folder, and says what cannot be used and what limits it."""

from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from shared.config.site import nearest
from shared.errors import IdentificationError
from shared.identification.dataset import caveats, checks, followed
from shared.identification.dataset.beginnings import (
    first_positions,
    logged_velocities,
    surely_moving,
)
from shared.identification.dataset.manifest import (
    FILE,
    Manifest,
    ModelTable,
    TrajectoryTable,
    read_manifest,
)
from shared.identification.dataset.programmes import of_programmes, repeats_of
from shared.identification.dataset.recordings import (
    PR2_JOINTS,
    Files,
    Recording,
    joint_named,
    read_recording,
)
from shared.identification.dataset.tables import Table
from shared.identification.dataset.types import (
    POSE,
    Caveat,
    Control,
    Dataset,
    Float64,
    ModelSource,
    Trajectory,
)

OTHER_EPOCH: Final = 10.0
"""A tracker that starts this much earlier or later has a clock of another epoch (s)."""
TURN: Final = 2.0 * np.pi
NANO: Final = 1e9

Names = tuple[str, ...]


def read_dataset(folder: Path | str) -> Dataset:
    """Return the data set in a folder; ``docs/dataset.md`` is the contract.

    Raises:
        IdentificationError: something is missing, damaged, or cannot be used; says which file,
            column and row, what was expected and what to do.
    """
    folder, files = Path(folder), Files()
    manifest = read_manifest(folder / FILE, files.read(folder / FILE))
    source = _source(folder, manifest.model, files)
    trajectories: list[Trajectory] = []
    found: list[Caveat] = []
    joints: Names = ()
    actuators: Names = ()
    for entry in manifest.trajectory:
        recording = read_recording(folder / entry.name, manifest, files)
        if not trajectories:
            joints = PR2_JOINTS if source.kind == "pr2" else recording.joints
            actuators = recording.actuators
            _check_continuous(folder / FILE, manifest, joints)
        first = manifest.trajectory[0].name
        _check_alike(joints, recording.joints, (first, entry.name), "joints")
        _check_alike(actuators, recording.actuators, (first, entry.name), "command")
        made, limits = _trajectory(folder / FILE, entry, recording, joints, actuators, manifest)
        trajectories.append(made)
        found += limits
    _check_copies(folder, trajectories)
    trajectories, differing = repeats_of(trajectories, manifest.control)
    found += caveats.of_set(trajectories, joints, manifest.control)
    found = followed.among_all(found, len(trajectories)) + of_programmes(trajectories) + differing
    return Dataset(
        folder, source, manifest.control, joints, actuators, tuple(trajectories), tuple(found),
        files.hash,
    )  # fmt: skip


def _source(folder: Path, model: ModelTable, files: Files) -> ModelSource:
    if model.kind == "mjcf":
        path = folder / model.path
        files.read(path)
        return ModelSource("mjcf", path, tracked=model.tracked, encoders=model.encoders)
    parameters = folder / model.parameters if model.parameters else None
    if parameters is not None:
        files.read(parameters)
    return ModelSource("pr2", arm=model.arm, parameters=parameters)


def _check_alike(one: Names, other: Names, names: tuple[str, str], file: str) -> None:
    if odd := sorted(set(one) ^ set(other)):
        raise IdentificationError(
            f"trajectories {names[0]!r} and {names[1]!r} differ in {odd[0]!r} of their {file} "
            "tables: all trajectories of a data set have the same columns"
        )


def _check_continuous(path: Path, manifest: Manifest, joints: Names) -> None:
    for name in manifest.continuous:
        if joint_named(name, manifest.model) not in joints:
            raise IdentificationError(
                f"{path}: continuous names {name!r}, which is no joint of the data; "
                f"{nearest(name, joints)}"
            )


def _check_copies(folder: Path, trajectories: list[Trajectory]) -> None:
    for one in trajectories:
        for other in trajectories:
            if one.split == "train" and other.split == "test" and np.array_equal(one.q, other.q):
                raise IdentificationError(
                    f"{folder / other.name} (test) has the same readings as {one.name!r} (train): "
                    "held-out data must be of another recording"
                )


def _trajectory(
    path: Path, entry: TrajectoryTable, recording: Recording, joints: Names, actuators: Names,
    manifest: Manifest,
) -> tuple[Trajectory, list[Caveat]]:  # fmt: skip
    name, readings, command = entry.name, recording.readings, recording.command
    zero = min(int(command.t_ns[0]), int(readings.t_ns[0]))
    times = _seconds(readings, zero)
    q, found = _positions(name, recording, joints, manifest)
    qd, missing_velocity = _optional(name, recording, "qd", joints)
    effort, missing_effort = _optional(name, recording, "effort", joints)
    for index, joint in enumerate(joints if qd is not None else ()):
        assert qd is not None
        checks.check_velocities(readings.path, joint, times, q[:, index], qd[:, index])
    if actuators == POSE:
        sent = checks.poses_of(command)
    else:
        checks.check_finite(command, actuators)
        sent = np.stack([command.columns[each] for each in actuators], axis=1)
        found += _check_commands(name, recording, joints, q, manifest.control)
    speed = surely_moving(times, q) if qd is None else logged_velocities(times, q, qd)
    made = Trajectory(
        name, entry.split, entry.repeats,
        _initial(path, entry, "initial", joints, first_positions(times, q, speed), manifest.model),
        _initial(path, entry, "initial_velocity", joints, speed, manifest.model),
        _seconds(command, zero), sent, times, q, qd, effort,
    )  # fmt: skip
    made, clock = _tracked(made, recording.tracker, zero)
    found += missing_velocity + missing_effort + clock
    if recording.ignored:
        text = f"not used: {', '.join(recording.ignored[:12])}"
        found.append(Caveat("ignored_columns", name, text))
    for stream, at in (
        ("command", made.command_at), ("joints", made.joints_at), ("tracker", made.tracker_at),
    ):  # fmt: skip
        found += [] if at is None else caveats.of_times(name, stream, at)
    has_velocity = entry.initial_velocity is not None or qd is not None
    found += caveats.of_start(made, entry.initial is not None, has_velocity)
    found += caveats.of_joints(made, joints) + caveats.of_tracker(made)
    return made, found


def _check_commands(
    name: str, recording: Recording, joints: Names, q: Float64, control: Control
) -> list[Caveat]:
    """Check that joints go where they are sent, as far as commands are named like them."""
    command, readings = recording.command, recording.readings
    rows = np.maximum(np.searchsorted(command.t_ns, readings.t_ns, side="right") - 1, 0)
    got = {each: q[:, index] for index, each in enumerate(joints)}
    if control == "torque":
        torques = {each: column[rows] for each, column in command.columns.items()}
        return followed.of_torques(name, torques, got)
    sent = {each: command.columns[each][rows] for each in joints if each in command.columns}
    for joint, positions in sent.items():
        checks.check_unit(command.path, joint, positions, got[joint])
    at: Float64 = 1e-9 * (readings.t_ns - readings.t_ns[0])
    return followed.of_commands(name, at, sent, got)


def _positions(
    name: str, recording: Recording, joints: Names, manifest: Manifest
) -> tuple[Float64, list[Caveat]]:
    """Return float64[T, J]; angles that jumped by whole turns at a border do so no more."""
    continuous = [joint_named(each, manifest.model) for each in manifest.continuous]
    table = _of_kind(recording, "q", joints)
    checks.check_finite(table, list(table.columns))
    columns: list[Float64] = []
    unwrapped: list[str] = []
    for joint, (column_name, column) in zip(joints, table.columns.items(), strict=True):
        checks.check_positions(table, column_name, joint, joint in continuous)
        wraps = np.abs(np.abs(np.diff(column)) - TURN) < 0.1 * TURN
        if wraps.any() and float(np.ptp(column)) <= 1.05 * TURN:
            column = np.unwrap(column)
            unwrapped.append(joint)
        columns.append(column)
    found: list[Caveat] = []
    if unwrapped:
        text = f"{', '.join(unwrapped)} jumped by a whole turn; the angle was made continuous"
        found.append(Caveat("unwrapped", name, text))
    return np.stack(columns, axis=1), found


def _optional(
    name: str, recording: Recording, kind: str, joints: Names
) -> tuple[Float64 | None, list[Caveat]]:
    """Return float64[T, J] of what may be missing; a column of NaN alone is missing, too."""
    there = recording.columns[kind]
    known = [each for each in joints if each in there and not np.isnan(there[each]).all()]
    if not known:
        return None, []
    if len(known) < len(joints):
        missing = ", ".join(each for each in joints if each not in known)
        text = f"{kind}_<joint> of {missing} is not there; that of the others is not used"
        word = "velocity" if kind == "qd" else kind
        return None, [Caveat(f"partial_{word}", name, text)]
    table = _of_kind(recording, kind, joints)
    checks.check_finite(table, list(table.columns))
    if kind == "effort":
        checks.check_efforts(table, list(table.columns))
    return np.stack(list(table.columns.values()), axis=1), []


def _of_kind(recording: Recording, kind: str, joints: Names) -> Table:
    """Return the columns of one kind, in the order of the joints."""
    readings, columns = recording.readings, recording.columns[kind]
    chosen = {f"{kind}_{joint}": columns[joint] for joint in joints}
    return Table(readings.path, readings.t_ns, chosen, ())


def _initial(
    path: Path, entry: TrajectoryTable, key: str, joints: Names, default: Float64,
    model: ModelTable,
) -> Float64:  # fmt: skip
    made = default.copy()
    table: dict[str, float] = getattr(entry, key) or {}
    for given, value in table.items():
        joint = joint_named(given, model)
        if joint not in joints:
            raise IdentificationError(
                f"{path}: {key} of trajectory {entry.name!r} names {given!r}, which is no joint of "
                f"the data; {nearest(given, joints)}"
            )
        made[joints.index(joint)] = value
    return made


def _tracked(made: Trajectory, table: Table | None, zero: int) -> tuple[Trajectory, list[Caveat]]:
    """Return a trajectory with its tracker, and what was done about the tracker's clock."""
    if table is None:
        return made, []
    poses = checks.poses_of(table)
    found: list[Caveat] = []
    start = (int(table.t_ns[0]) - zero) / NANO
    times = _seconds(table, zero)
    if abs(start) > OTHER_EPOCH:
        times = _seconds(table, int(table.t_ns[0]))
        found.append(Caveat("tracker_clock", made.name, (
            f"the tracker's times start {start:.6g} s after the others, so its clock has another "
            "epoch; it is taken to have started with them, and a constant lag of it cannot be told"
        )))  # fmt: skip
    overlap = max(0.0, min(float(times[-1]), made.duration) - max(float(times[0]), 0.0))
    if overlap < checks.SHORTEST:
        raise IdentificationError(
            f"{table.path} overlaps the joint readings by {overlap:.3g} s, at least "
            f"{checks.SHORTEST} s is needed: it is from {times[0]:.3f} s to {times[-1]:.3f} s of "
            f"{made.duration:.3f} s"
        )
    return replace(made, tracker_at=times, tracker=poses), found


def _seconds(table: Table, zero: int) -> Float64:
    return (table.t_ns - zero).astype(np.float64) / NANO
