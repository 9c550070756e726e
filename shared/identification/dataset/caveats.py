"""What limits a usable recording: named, with the value and what to do."""

import re
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from shared.identification.dataset.beginnings import LEAST, first_velocities
from shared.identification.dataset.checks import is_resolved, velocity_ratio
from shared.identification.dataset.resolution import step_of
from shared.identification.dataset.types import Caveat, Control, Float64, Trajectory

GAP_PERIODS: Final = 5.0
"""A hole is longer than this many nominal periods."""
JITTER: Final = 0.3
"""Of a nominal period, that a tenth of the steps differ from it."""
LEAST_RANGE: Final = 0.02
"""A joint that moves less (rad, m) shows little."""
LEAST_SPEED: Final = 0.05
"""A joint that is slower (rad/s, m/s) shows little."""
HIGHEST_SPEED: Final = 30.0
"""Of an arm's joint (rad/s, m/s)."""
AROUND: Final = 10
"""Rows, over which a joint that is on its way goes on by a step of its encoder a row."""
FEW_SPIKES: Final = 0.01
"""Share of the rows that are spikes at most: else all of them are noisy, or in degrees."""
COARSE: Final = 1e-3
"""Steps of an encoder (rad, m)."""
SLOWEST_HZ: Final = 40.0
FASTER: Final = 1.5
"""Times the fastest motion that is fitted to: what is held out says nothing of the fit then."""
MOVES: Final = 0.05
"""Of the fastest motion: what is slower stands."""
ONE_SPEED: Final = 0.6
"""Of the speed of four fifths of a motion: as fast is four fifths of it, too, that has one speed.
Of a sine it is a third."""
JUMP_SPEED: Final = 10.0
"""Of a tracker (m/s)."""
JUMP: Final = 0.03
"""m."""
NAMED_HOLES: Final = 3
MOST_NAMED: Final = 4
"""Recordings that are named beside the first that a caveat is about."""
_NUMBER: Final = re.compile(r"(?<![\w.'])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?![\w'])")
"""Not part of a name."""


def in_words(caveats: Sequence[Caveat]) -> tuple[str, ...]:
    """Return caveats as sentences; what many recordings share but for its numbers is said once."""
    alike: dict[str, list[Caveat]] = {}
    for each in caveats:
        alike.setdefault(_NUMBER.sub("#", each.text), []).append(each)
    said: list[str] = []
    for first, *others in alike.values():
        names = (
            [f"{len(others)} more"]
            if len(others) > MOST_NAMED
            else [each.trajectory for each in others]
        )
        too = f" (much the same: {', '.join(names)})" if others else ""
        said.append(f"{first.trajectory}: {first.text}{too}".lstrip(": "))
    return tuple(said)


def of_times(name: str, stream: str, times: Float64) -> list[Caveat]:
    """Return caveats on the times of a stream: ``gap``, ``jitter``, ``slow_log``.

    Args:
        name: of the trajectory.
        stream: ``command``, ``joints`` or ``tracker``.
        times: float64[N] (s), rising.
    """
    if len(times) < 20:
        return []
    steps = np.diff(times)
    period = float(np.median(steps))
    found: list[Caveat] = []
    holes = np.flatnonzero(steps > GAP_PERIODS * period)
    if len(holes):
        longest = holes[np.argsort(-steps[holes])[:NAMED_HOLES]]
        where = ", ".join(f"{steps[row]:.3g} s at {times[row]:.3f} s" for row in sorted(longest))
        found.append(Caveat("gap", name, (
            f"{stream} has {len(holes)} holes of over {GAP_PERIODS:g} periods of "
            f"{1e3 * period:.3g} ms, the longest: {where}; nothing is known of these times"
        )))  # fmt: skip
    spread = float(np.quantile(np.abs(steps - period), 0.9))
    if spread > JITTER * period:
        found.append(Caveat("jitter", name, (
            f"a tenth of the rows of {stream} come {1e3 * spread:.3g} ms or more off their period "
            f"of {1e3 * period:.3g} ms; write the time of measurement, not of receipt"
        )))  # fmt: skip
    if stream == "joints" and period > 1.0 / SLOWEST_HZ:
        found.append(Caveat("slow_log", name, (
            f"joints are logged {1.0 / period:.3g} times a second; delays and fast effects need "
            "100 or more"
        )))  # fmt: skip
    return found


def of_start(trajectory: Trajectory, has_initial: bool, has_velocity: bool) -> list[Caveat]:
    """Return caveats on a beginning: ``late_joints``, ``late_command``, ``moving_start``.

    Args:
        trajectory: with both.
        has_initial: its initial positions were given.
        has_velocity: its initial velocities were given, or logged.
    """
    name, found = trajectory.name, list[Caveat]()
    joints_at, command_at = trajectory.joints_at, trajectory.command_at
    period = float(np.median(np.diff(joints_at)))
    late = max(0.05, GAP_PERIODS * period)
    if joints_at[0] > late and not has_initial:
        found.append(Caveat("late_joints", name, (
            f"the first reading is {joints_at[0]:.3g} s after the first command, and is taken for "
            "the state then; give initial, or log joints from before the first command"
        )))  # fmt: skip
    if command_at[0] > late:
        found.append(Caveat("late_command", name, (
            f"the first command is {command_at[0]:.3g} s after the first reading; the first "
            "command is taken to hold from the start"
        )))  # fmt: skip
    if not has_velocity:
        speeds = np.abs(first_velocities(joints_at, trajectory.q)[0])
        fastest = int(np.argmax(speeds))
        if speeds[fastest] > LEAST:
            told = f"the arm starts at {speeds[fastest]:.3g} rad/s, taken from its first readings;"
            if not trajectory.initial_qd[fastest]:
                told = (
                    f"the arm goes at {speeds[fastest]:.3g} rad/s in its first readings, which do "
                    "not surely say that it did before, and is taken to start at rest; if not,"
                )
            found.append(Caveat("moving_start", name, (
                f"{told} give initial_velocity, or log velocities"
            )))  # fmt: skip
    return found


def of_joints(trajectory: Trajectory, joints: Sequence[str]) -> list[Caveat]:
    """Return ``fast``, ``spikes``, ``quantised``, ``held_readings``, ``velocity_disagrees``."""
    name, found = trajectory.name, list[Caveat]()
    q, times = trajectory.q, trajectory.joints_at
    steps = np.diff(q, axis=0)
    speeds = steps / np.diff(times)[:, None]
    least = [step_of(column) for column in q.T]
    still = np.all(steps == 0.0, axis=1)[_on_the_way(q, least)]
    if len(still) > 20 and 0.3 < float(still.mean()) < 0.98:
        found.append(Caveat("held_readings", name, (
            f"{still.mean():.0%} of the rows on the way repeat the reading before: the log is "
            "faster than the joints are read; write each reading once"
        )))  # fmt: skip
    for index, joint in enumerate(joints):
        speed = float(np.quantile(np.abs(speeds[:, index]), 0.99))
        if speed > HIGHEST_SPEED:
            found.append(Caveat("fast", name, (
                f"joint {joint!r} goes at {speed:.3g} rad/s (m/s) by its positions: are they in "
                "degrees or mm, or noisy?"
            )))  # fmt: skip
        if rows := _spikes(speeds[:, index]):
            at = ", ".join(f"{times[row]:.3f}" for row in rows[:3])
            found.append(Caveat("spikes", name, (
                f"joint {joint!r} jumps away for one reading and back, at {at} s"
                f"{' and more often' if len(rows) > 3 else ''}: leave such rows out"
            )))  # fmt: skip
        if (step := least[index]) > COARSE:
            values = len(np.unique(q[:, index]))
            found.append(Caveat("quantised", name, (
                f"joint {joint!r} is read in steps of {step:.3g} rad (m), {values} values in "
                "all: nothing smaller is seen"
            )))  # fmt: skip
        if trajectory.qd is not None:
            column = trajectory.qd[:, index]
            is_moving = np.ptp(q[:, index]) > 10.0 * LEAST_RANGE and is_resolved(column)
            if is_moving and velocity_ratio(times, q[:, index], column) is None:
                found.append(Caveat("velocity_disagrees", name, (
                    f"the logged velocity of {joint!r} is not the derivative of its position "
                    "(correlation under 0.9): is it of another joint, delayed, or filtered?"
                )))  # fmt: skip
    return found


def _on_the_way(q: Float64, least: Sequence[float]) -> NDArray[np.bool_]:
    """Return bool[T - 1], which readings come while a joint goes on by many of its least steps.

    A joint that rests, or creeps from one step of its encoder to the next, is read anew each time.
    """
    out = np.zeros(max(len(q) - 1, 0), np.bool_)
    for column, step in zip(q.T, least, strict=True):
        gone = np.abs(column[AROUND:] - column[:-AROUND])
        out[np.flatnonzero(gone > AROUND * step) + AROUND // 2] = True
    return out


def _spikes(speeds: Float64) -> list[int]:
    """Return rows whose reading is one no joint was at: it goes there and back too fast."""
    is_fast = np.abs(speeds) > HIGHEST_SPEED
    is_back = is_fast[:-1] & is_fast[1:] & (speeds[:-1] * speeds[1:] < 0.0)
    rows: list[int] = (np.flatnonzero(is_back) + 1).tolist()
    return rows if len(rows) <= FEW_SPIKES * len(speeds) else []


def of_tracker(trajectory: Trajectory) -> list[Caveat]:
    """Return ``tracker_jump`` where the tracker goes faster than an arm can."""
    if trajectory.tracker is None or trajectory.tracker_at is None or len(trajectory.tracker) < 3:
        return []
    ways = np.linalg.norm(np.diff(trajectory.tracker[:, :3], axis=0), axis=1)
    jumps = np.flatnonzero((ways / np.diff(trajectory.tracker_at) > JUMP_SPEED) & (ways > JUMP))
    if not len(jumps):
        return []
    row = int(jumps[np.argmax(ways[jumps])])
    return [Caveat("tracker_jump", trajectory.name, (
        f"the tracker jumps {len(jumps)} times, the most by {1e3 * ways[row]:.0f} mm at "
        f"{trajectory.tracker_at[row]:.3f} s: leave rows out where it is not seen"
    ))]  # fmt: skip


def of_set(
    trajectories: Sequence[Trajectory], joints: Sequence[str], control: Control
) -> list[Caveat]:
    """Return the caveats on all recordings together."""
    found: list[Caveat] = []
    if not any(each.repeats for each in trajectories):
        found.append(Caveat("no_repeat", "", (
            "no trajectory repeats another, so noise is estimated from the residual alone; play "
            'one programme twice and write repeats = "<name>"'
        )))  # fmt: skip
    for name, words, missing in (
        ("no_tracker", "was tracked from outside: what the encoders do not see stays hidden, and "
         "measurement cannot be told from plant", [e for e in trajectories if e.tracker is None]),
        ("no_velocity", "has logged velocities (qd_<joint>); they are taken from the positions",
         [e for e in trajectories if e.qd is None]),
        ("no_effort", "has logged efforts (effort_<joint>): controller and plant are harder to "
         "tell apart", [e for e in trajectories if e.effort is None]),
    ):  # fmt: skip
        if name == "no_effort" and control == "torque":
            continue
        if len(missing) == len(trajectories):
            found.append(Caveat(name, "", f"no trajectory {words}"))
        elif missing:
            names = ", ".join(each.name for each in missing[:6])
            found.append(Caveat(name, missing[0].name, (
                f"not every trajectory {words}; not {names}" + (", ..." if len(missing) > 6 else "")
            )))  # fmt: skip
    return found + _excitation(trajectories, joints)


def _excitation(trajectories: Sequence[Trajectory], joints: Sequence[str]) -> list[Caveat]:
    """Return ``little_excitation``, ``one_speed`` and ``faster_test``."""
    found: list[Caveat] = []
    train = [each for each in trajectories if each.split == "train"]
    held_out = [each for each in trajectories if each.split == "test"]
    for index, joint in enumerate(joints):
        span = max(float(np.ptp(each.q[:, index])) for each in train)
        speed = max(_speed(each, index) for each in train)
        fastest = max(held_out, key=lambda each: _speed(each, index))
        if _speed(fastest, index) > FASTER * max(speed, LEAST_SPEED):
            found.append(Caveat("faster_test", fastest.name, (
                f"joint {joint!r} goes at up to {_speed(fastest, index):.2g} rad/s (m/s), held "
                f"out, and at {speed:.2g} in what is fitted to: limits and friction at such "
                "speeds cannot be fitted; have fast motion in both"
            )))  # fmt: skip
        if span < LEAST_RANGE or speed < LEAST_SPEED:
            found.append(Caveat("little_excitation", "", (
                f"joint {joint!r} moves by {span:.2g} rad (m) at up to {speed:.2g} rad/s (m/s) in "
                f"the train recordings; its friction, inertia and gain need over {LEAST_RANGE} and "
                f"{LEAST_SPEED}: record a motion of it"
            )))  # fmt: skip
            continue
        slow, fast = _usual_speeds(np.concatenate([_speeds(each, index) for each in train]))
        if slow > ONE_SPEED * fast:
            found.append(Caveat("one_speed", "", (
                f"joint {joint!r} goes at {slow:.2g} to {fast:.2g} rad/s (m/s) for most of the "
                "time that it moves in the train recordings: dry and viscous friction are not "
                "told apart by that, nor what falls off with speed; record slow motion, too"
            )))  # fmt: skip
    return found


def _usual_speeds(speeds: Float64) -> tuple[float, float]:
    """Return between which speeds three fifths of a motion are, where it moves."""
    moving = speeds[speeds > MOVES * speeds.max()]
    slow, fast = np.quantile(moving, [0.2, 0.8])
    return float(slow), float(fast)


def _speed(trajectory: Trajectory, index: int) -> float:
    """Return the speed of a joint that is passed on a hundredth of the way."""
    speeds = _speeds(trajectory, index)
    return float(np.quantile(speeds, 0.99)) if len(speeds) else 0.0


def _speeds(trajectory: Trajectory, index: int) -> Float64:
    """Return the speeds of a joint, each over some 50 ms (rad/s, m/s)."""
    times = trajectory.joints_at
    stride = max(1, min(round(0.05 / float(np.median(np.diff(times)))), (len(times) - 1) // 4))
    marks = np.arange(0, len(times), stride)
    return np.abs(np.diff(trajectory.q[marks, index]) / np.diff(times[marks]))
