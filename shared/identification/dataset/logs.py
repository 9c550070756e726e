"""Recordings as other programs log them, with times in ns, made into trajectories."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from shared.errors import IdentificationError
from shared.identification.dataset.reading import NANO, OTHER_EPOCH
from shared.identification.dataset.types import (
    Control,
    Dataset,
    Float64,
    ModelSource,
    Split,
    Trajectory,
)

Int64 = NDArray[np.int64]
HELD_OUT: Final = 4
"""One of so many recordings is held out, the last ones."""


@dataclass(frozen=True)
class Rows:
    """Numbers, and the times they are of."""

    t_ns: Int64
    """int64[N], rising."""
    values: Float64
    """float64[N, ...]."""

    def between(self, begin_ns: int, end_ns: int) -> "Rows":
        """Return the rows from one time up to another."""
        which = (self.t_ns >= begin_ns) & (self.t_ns < end_ns)
        return Rows(self.t_ns[which], self.values[which])


@dataclass(frozen=True)
class Log:
    """One recording."""

    name: str
    command: Rows
    """float64[C, U]."""
    readings: Rows
    """float64[T, 3, J]: positions, velocities and efforts; NaN for what is not known."""
    tracker: Rows | None = None
    """float64[K, 7], in the robot's base frame, on a clock of its own."""

    def cut(self, at_ns: int) -> tuple["Log", "Log"]:
        """Return what was before a time and after it; the command then in force is in both."""
        force = self.command.t_ns[self.command.t_ns <= at_ns]
        since = int(force[-1]) if len(force) else at_ns
        halves = [
            Log(
                f"{self.name}-{word}",
                self.command.between(begin, end),
                self.readings.between(max(begin, at_ns) if word == "b" else begin, end),
                None if self.tracker is None else self.tracker.between(begin, end),
            )
            for word, begin, end in (("a", -(1 << 62), at_ns), ("b", since, 1 << 62))
        ]
        return halves[0], halves[1]


def rising(t_ns: Int64, values: Float64) -> Rows:
    """Return rows without those whose time is not after all before them."""
    before = np.maximum.accumulate(np.concatenate([[np.iinfo(np.int64).min], t_ns[:-1]]))
    which = t_ns > before
    return Rows(t_ns[which], values[which])


def data_set(
    source: ModelSource, control: Control, joints: Sequence[str], actuators: Sequence[str],
    logs: Sequence[Log], held_out: Sequence[str] = (), repeats: dict[str, str] | None = None,
) -> Dataset:  # fmt: skip
    """Return recordings as a data set to write.

    Args:
        source: the model.
        control: what the commands are.
        joints: names of J joints.
        actuators: names of the commands' U columns.
        logs: the recordings, in the order they were made.
        held_out: names of those to hold out; the last quarter, at least one, where none is named.
        repeats: by name, the name of another recording whose commands it repeats.

    Raises:
        IdentificationError: there are fewer than two recordings, or one has nothing in it.
    """
    if len(logs) < 2:
        raise IdentificationError(
            f"{len(logs)} usable recordings, at least two are needed: to fit to and to hold out"
        )
    last = max(1, round(len(logs) / HELD_OUT))
    names = held_out or [log.name for log in logs[-last:]]
    trajectories = [
        replace(
            trajectory(log, "test" if log.name in names else "train"),
            repeats=(repeats or {}).get(log.name, ""),
        )
        for log in logs
    ]
    return Dataset(
        Path(), source, control, tuple(joints), tuple(actuators), tuple(trajectories), (), ""
    )


def trajectory(log: Log, split: Split) -> Trajectory:
    """Return a recording as a trajectory; it starts at its first reading, as logged.

    Velocities and efforts that are not known of every joint at every time are left out. A tracker
    whose clock has another epoch is taken to have started with the rest.

    Raises:
        IdentificationError: it has no commands or no readings.
    """
    command, readings = log.command, log.readings
    for rows, what in ((command, "command"), (readings, "joint reading")):
        if not len(rows.t_ns):
            raise IdentificationError(f"recording {log.name!r} has no {what}")
    zero = min(int(command.t_ns[0]), int(readings.t_ns[0]))
    q, qd, effort = readings.values[:, 0], _known(readings, 1), _known(readings, 2)
    made = Trajectory(
        log.name, split, "", q[0], np.zeros_like(q[0]) if qd is None else qd[0],
        _seconds(command.t_ns, zero), command.values, _seconds(readings.t_ns, zero), q, qd, effort,
    )  # fmt: skip
    if log.tracker is None or not len(log.tracker.t_ns):
        return made
    start = int(log.tracker.t_ns[0])
    is_other = abs(start - zero) > OTHER_EPOCH * NANO
    at = _seconds(log.tracker.t_ns, start if is_other else zero)
    return replace(made, tracker_at=at, tracker=log.tracker.values)


def _known(readings: Rows, kind: int) -> Float64 | None:
    values = readings.values[:, kind]
    return values if np.isfinite(values).all() else None


def _seconds(t_ns: Int64, zero: int) -> Float64:
    return (t_ns - zero).astype(np.float64) / NANO
