"""What makes a recording unusable: time that does not rise, values and units that cannot be."""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from shared.errors import IdentificationError
from shared.identification.dataset.tables import TIME, Table
from shared.identification.dataset.types import POSE, Float64

SHORTEST: Final = 0.5
"""Of a recording, and of what a tracker saw of it (s)."""
LONGEST: Final = 86_400.0
"""Of a recording (s)."""
FASTEST_HZ: Final = 50_000.0
"""Rows a second that a real log has at most."""
LARGEST_VALUE: Final = 1e9
"""Of anything, in any unit."""
LARGEST_ANGLE: Final = 4.0 * np.pi
"""Of a joint on most rows (rad), unless it turns without end."""
LARGEST_RANGE: Final = 60.0
"""Of a joint in one recording (rad, m)."""
LARGEST_EFFORT: Final = 1e5
"""N m, N."""
LARGEST_DISTANCE: Final = 100.0
"""Of a pose from the robot's base (m)."""
UNIT_TOLERANCE: Final = 0.01
"""Of a quaternion's length."""
LATEST: Final = 1.0
"""From the last command to the first joint reading (s)."""
LATEST_NS: Final = 1 << 62
"""Of a time; the year 2116."""
_PREFIXES: Final = ((1e3, "microseconds"), (1e6, "milliseconds"), (1e9, "seconds"))
_SPEED_UNITS: Final = (
    (180.0 / np.pi, "it looks like deg/s: write rad/s"),
    (np.pi / 180.0, "the positions look like degrees: write rad"),
    (1000.0, "it looks like mrad/s or mm/s: write rad/s or m/s"),
    (0.001, "the positions look like mrad or mm: write rad or m"),
    (30.0 / np.pi, "it looks like revolutions a minute: write rad/s"),
    (0.5 / np.pi, "it looks like revolutions a second: write rad/s"),
)


def check_time(table: Table) -> None:
    """Check that the times of a table rise, in nanoseconds.

    Raises:
        IdentificationError: they do not; names the row.
    """
    t_ns = table.t_ns
    wide = (t_ns > LATEST_NS) | (t_ns < -LATEST_NS)
    if wide.any():
        row = int(np.argmax(wide))
        raise IdentificationError(
            f"{table.path}: column {TIME!r}, row {row} is {t_ns[row]}, expected nanoseconds since "
            "1970 or since the start"
        )
    steps = np.diff(t_ns)
    if len(steps) and steps.min() <= 0:
        row = int(np.argmax(steps <= 0))
        what = "the same as" if steps[row] == 0 else "before"
        advice = "sort the rows and leave one of each time"
        if steps.min() == 0 and np.count_nonzero(steps == 0) > 0.5 * len(steps):
            advice = "most are alike, so they look like whole seconds: write nanoseconds"
        raise IdentificationError(
            f"{table.path}: column {TIME!r}, row {row + 1} ({t_ns[row + 1]}) is {what} row {row} "
            f"({t_ns[row]}): times must rise; {advice}"
        )
    length = float(t_ns[-1] - t_ns[0]) / 1e9
    if length > LONGEST:
        raise IdentificationError(
            f"{table.path}: column {TIME!r} spans {length:.4g} s, at most {LONGEST:g} s is read: "
            f"are these nanoseconds? Row 0 is {t_ns[0]}, row {len(t_ns) - 1} is {t_ns[-1]}"
        )
    if len(t_ns) < 8:
        return
    rate = 1e9 / float(np.median(steps))
    if rate > FASTEST_HZ or length < SHORTEST:
        for factor, unit in _PREFIXES:
            is_plausible = 0.5 <= rate / factor <= FASTEST_HZ and length * factor <= LONGEST
            if is_plausible and length * factor >= SHORTEST and rate > 2000.0:
                raise IdentificationError(
                    f"{table.path}: column {TIME!r} rises by {np.median(steps):g} a row, so it "
                    f"looks like {unit}: write nanoseconds (times {factor:g})"
                )
    if rate > FASTEST_HZ:
        raise IdentificationError(
            f"{table.path}: column {TIME!r} rises by {np.median(steps):g} ns a row, which is "
            f"{rate:.3g} rows a second (at most {FASTEST_HZ:g}): are these nanoseconds?"
        )


def check_finite(table: Table, names: Sequence[str]) -> None:
    """Check that columns hold finite numbers of some sense.

    Raises:
        IdentificationError: one does not; names column and row.
    """
    for name in names:
        bad = ~(np.abs(table.columns[name]) <= LARGEST_VALUE)
        if bad.any():
            row = int(np.argmax(bad))
            raise IdentificationError(
                f"{table.path}: column {name!r}, row {row} is {table.columns[name][row]} "
                f"({int(bad.sum())} of {len(bad)} rows are no numbers up to {LARGEST_VALUE:g}): "
                "leave such rows out"
            )


def poses_of(table: Table) -> Float64:
    """Return float64[N, 7], the poses of a table, their quaternions of unit length and one sign.

    Raises:
        IdentificationError: a column is missing, a value is not finite, a quaternion is not of
            unit length, or a position cannot be in metres.
    """
    require(table, POSE, "a pose is x y z (m) and the unit quaternion qw qx qy qz")
    check_finite(table, POSE)
    poses = np.stack([table.columns[name] for name in POSE], axis=1)
    far = np.abs(poses[:, :3]) > LARGEST_DISTANCE
    if far.any():
        row, column = (int(index) for index in np.argwhere(far)[0])
        raise IdentificationError(
            f"{table.path}: column {POSE[column]!r}, row {row} is {poses[row, column]:g} m, "
            f"at most {LARGEST_DISTANCE:g} m from the robot's base can be: write metres"
        )
    lengths = np.linalg.norm(poses[:, 3:], axis=1)
    bad = np.abs(lengths - 1.0) > UNIT_TOLERANCE
    if bad.any():
        row = int(np.argmax(bad))
        raise IdentificationError(
            f"{table.path}: row {row} has the quaternion (qw qx qy qz) = "
            f"({', '.join(f'{value:.4g}' for value in poses[row, 3:])}) of length "
            f"{lengths[row]:.4g}, expected 1 within {UNIT_TOLERANCE}: leave such rows out"
        )
    loose = np.abs(lengths - 1.0) > 1e-9
    poses[loose, 3:] /= lengths[loose, None]
    # q and -q are one rotation; what is between two poses is taken of neighbours of one sign
    turns = np.einsum("ij,ij->i", poses[1:, 3:], poses[:-1, 3:])
    poses[1:, 3:] *= np.cumprod(np.where(turns < 0.0, -1.0, 1.0))[:, None]
    return poses


def require(table: Table, names: Sequence[str], why: str) -> None:
    """Check that columns are there.

    Raises:
        IdentificationError: one is missing.
    """
    for name in names:
        if name not in table.columns:
            there = ", ".join((TIME, *table.columns, *table.others)[:16])
            raise IdentificationError(
                f"{table.path} has no column {name!r} ({why}); it has {there}"
            )


def require_one(table: Table, there: Collection[str], joint: str, names: tuple[str, str]) -> None:
    """Check that a joint of a PR2's arm is there, under either name.

    Raises:
        IdentificationError: it is not.
    """
    if joint not in there:
        raise IdentificationError(
            f"{table.path} has no column {names[0]!r} (or {names[1]!r}): "
            "a PR2's data have all seven joints of the arm"
        )


def check_positions(table: Table, name: str, joint: str, is_continuous: bool) -> None:
    """Check that a joint's positions can be in rad or m.

    Args:
        table: ``joints``.
        name: of the column.
        joint: whose it is.
        is_continuous: it may turn without end.

    Raises:
        IdentificationError: they are too large.
    """
    values = table.columns[name]
    if is_continuous or not is_too_large(values):
        return
    span = float(np.ptp(values))
    what = f"spans {span:.4g}"
    if span <= LARGEST_RANGE:
        what = f"is over 4 pi on most rows (row 0: {values[0]:.4g})"
    raise IdentificationError(
        f"{table.path}: column {name!r} {what}, which is no angle in rad and no way in m: are "
        f"these degrees or mm? If {joint!r} turns without end, add it to continuous = [...] in "
        "dataset.toml"
    )


def is_too_large(q: Float64) -> bool:
    """Return whether float64[T] are no positions in rad or m of a joint with limits."""
    share = float(np.mean(np.abs(q) > LARGEST_ANGLE))
    return share > 0.5 or float(np.ptp(q)) > LARGEST_RANGE


def check_velocities(path: Path, joint: str, times: Float64, q: Float64, qd: Float64) -> None:
    """Check that logged velocities are the derivative of the positions, in unit and sign.

    Args:
        path: of the table.
        joint: whose they are.
        times: float64[T] (s).
        q: float64[T] (rad, m).
        qd: float64[T] (rad/s, m/s).

    Raises:
        IdentificationError: they are proportional to it by another factor than 1.
    """
    ratio = velocity_ratio(times, q, qd) if is_resolved(qd) else None
    if ratio is None or 0.5 <= ratio <= 2.0:
        return
    name = f"qd_{joint}"
    if -2.0 <= ratio <= -0.5:
        raise IdentificationError(
            f"{path}: column {name!r} has the other sign than the derivative of 'q_{joint}' "
            f"(factor {ratio:.3g}): turn one of them round"
        )
    advice = "write rad and rad/s, or m and m/s"
    for factor, words in _SPEED_UNITS:
        if abs(abs(ratio) / factor - 1.0) < 0.15:
            advice = words
    raise IdentificationError(
        f"{path}: column {name!r} is {ratio:.4g} times the derivative of 'q_{joint}', "
        f"expected 1: {advice}"
    )


def check_unit(path: Path, joint: str, command: Float64, q: Float64) -> None:
    """Check that commanded positions are in the unit of a joint's readings.

    Args:
        path: of the table of commands.
        joint: whose they are.
        command: float64[T], the command in force at each reading.
        q: float64[T] (rad, m).

    Raises:
        IdentificationError: they follow each other, but for a factor between two units.
    """
    wanted, got = command - command.mean(), q - q.mean()
    sizes = float(np.linalg.norm(wanted)), float(np.linalg.norm(got))
    if min(sizes) < 1e-3 or float(wanted @ got) < 0.9 * sizes[0] * sizes[1]:
        return
    ratio = sizes[0] / sizes[1]
    for factor, unit in ((180.0 / np.pi, "degrees"), (1000.0, "mrad or mm")):
        for found, odd in ((ratio / factor, "command"), (ratio * factor, "reading")):
            if abs(found - 1.0) < 0.25:
                raise IdentificationError(
                    f"{path}: column {joint!r} moves {ratio:.4g} times as far as 'q_{joint}', "
                    f"expected about 1: the {odd} looks like {unit}; write rad or m in both"
                )


def velocity_ratio(times: Float64, q: Float64, qd: Float64) -> float | None:
    """Return by what factor ``qd`` is the derivative of ``q``; None where that is not to be seen.

    Both are compared as means over windows of some 50 ms (the mean of ``qd``, by the trapezoid
    rule, and the way over the time), so that neither a coarse encoder nor a short lag matters.
    """
    period = float(np.median(np.diff(times)))
    stride = max(1, round(0.05 / period))
    if len(times) < 20 * stride:
        stride = max(1, len(times) // 20)
    area = np.concatenate([[0.0], np.cumsum(0.5 * (qd[1:] + qd[:-1]) * np.diff(times))])
    marks = np.arange(0, len(times), stride)
    if len(marks) < 5:
        return None
    way, walked, took = np.diff(q[marks]), np.diff(area[marks]), np.diff(times[marks])
    speed, logged = way / took, walked / took
    if float(np.ptp(q)) < 1e-3 or float(speed.std()) < 1e-3 or float(logged.std()) < 1e-6:
        return None
    slope = float(speed @ logged) / float(speed @ speed)
    correlation = float(speed @ logged) / float(np.linalg.norm(speed) * np.linalg.norm(logged))
    return slope if abs(correlation) > 0.9 else None


def is_resolved(qd: Float64) -> bool:
    """Return whether float64[T] velocities change little enough from row to row to be compared.

    Their correlation with the row before is over 0.5, so a sine has six rows a period or more.
    """
    if len(qd) < 20:
        return False
    centred = qd - qd.mean()
    power = float(centred @ centred)
    return power > 0.0 and float(centred[1:] @ centred[:-1]) > 0.5 * power


def check_efforts(table: Table, names: Sequence[str]) -> None:
    """Check that efforts can be in N m or N.

    Raises:
        IdentificationError: one is too large.
    """
    for name in names:
        values = table.columns[name]
        row = int(np.argmax(np.abs(values)))
        if abs(values[row]) > LARGEST_EFFORT:
            raise IdentificationError(
                f"{table.path}: column {name!r}, row {row} is {values[row]:.4g}, at most "
                f"{LARGEST_EFFORT:g} N m or N can be: is it in mN m, or counts of a converter?"
            )


def check_overlap(command: Table, joints: Table) -> None:
    """Check that joints were read while commands held.

    Raises:
        IdentificationError: they were not, or for too short.
    """
    first, last = int(command.t_ns[0]), int(command.t_ns[-1])
    begin, end = int(joints.t_ns[0]), int(joints.t_ns[-1])
    length = (end - begin) / 1e9
    if length < SHORTEST:
        raise IdentificationError(
            f"{joints.path} spans {length:.3g} s, at least {SHORTEST} s is needed: record longer, "
            "or leave this trajectory out"
        )
    if end - first < SHORTEST * 1e9 or begin - last > LATEST * 1e9:
        raise IdentificationError(
            f"{command.path} is from {TIME} {first} to {last}, {joints.path.name} from {begin} to "
            f"{end}: they do not overlap, and both must be of one clock; "
            "take both times from the same computer's clock"
        )
