"""Where the person's bat is: sources of poses, and what is made of them."""

import math
from pathlib import Path
from typing import Protocol

import msgspec
import numpy as np

from services.robot_io.links import Floats, OtherRobot
from services.robot_io.poses import (
    Pose,
    Vector,
    add,
    distance,
    is_pose,
    length,
    rotation_between,
    scale,
    turned,
    unit,
)
from services.robot_io.replays import read_replay
from shared.bus.base import Bus
from shared.messages.topics import TRACKER

EXTRAPOLATED_SECONDS = 0.05
"""A bat that was not seen for so long is still taken to move on as it did."""
LOST_SECONDS = 0.1
"""One that was not seen for so long is not tracked."""
PROVEN_SECONDS = 0.2
"""A bat that was lost, or has jumped, must be seen for so long before it counts again."""
JUMP = 0.05
"""Further than this beyond where it was heading is a jump (m)."""
MAX_SPEED = 10.0
"""Nobody moves a bat faster (m/s)."""
MAX_TURN_SPEED = 60.0
"""Nobody turns one faster (rad/s)."""
SMOOTHING_SECONDS = 0.02
"""Time constant of the velocities."""
MAX_POSES = 64
"""Poses taken in one tick."""


class TrackedBat(msgspec.Struct, frozen=True, kw_only=True):
    """What a tracker knows now."""

    state: Floats
    """float64[13], world frame: pose, linear (m/s) and angular velocity (rad/s)."""
    is_valid: bool
    seen_at: float
    """By our monotonic clock (s)."""
    source: str = ""
    """Of the newest ``TrackerPose`` that was heard, empty where there are none."""
    sequence: int = -1
    """Of the same."""
    problem: str = ""
    """Why it is not tracked, where the tracker knows."""
    passed: tuple[str, ...] = ()
    """What was looked at and is in order, for the list that a person sees before arming."""


class Tracker(Protocol):
    """A source of the person's bat; nothing here may block."""

    def read(self, now: float) -> TrackedBat:
        """Return the bat now."""
        ...

    def rates(self) -> dict[str, float]:
        """Return what it measures of itself, by name with unit."""
        ...

    def counters(self) -> dict[str, int]:
        """Return what it has counted since the start."""
        ...

    def close(self) -> None:
        """Let go of the device."""
        ...


class Follower:
    """Makes states of bare poses: velocities, short gaps, jumps."""

    def __init__(self, start: Pose) -> None:
        """Begin with a bat that is not seen yet.

        Args:
            start: where it is shown until it is.
        """
        self._pose = start
        self._velocity: Vector = (0.0, 0.0, 0.0)
        self._spin: Vector = (0.0, 0.0, 0.0)
        self._seen_at = -math.inf
        self._since = math.inf
        self.rejected = 0
        """Poses that were none, or jumps."""

    def offer(self, pose: Pose, at: float) -> None:
        """Take a pose that was seen at an instant; one that cannot be is counted and left."""
        if not is_pose(pose):
            self.rejected += 1
            return
        pose = Pose(pose.position, unit(pose.orientation))
        passed = at - self._seen_at
        if passed <= 0.0:
            self._pose = pose  # two in one tick: the later counts
            return
        if passed > LOST_SECONDS or self._jumps(pose, passed):
            self.rejected += passed <= LOST_SECONDS
            self._begin(pose, at)
            return
        keep = math.exp(-passed / SMOOTHING_SECONDS)
        moved = scale(add(pose.position, self._pose.position, -1.0), 1.0 / passed)
        turn = scale(rotation_between(self._pose.orientation, pose.orientation), 1.0 / passed)
        self._velocity = add(scale(self._velocity, keep), moved, 1.0 - keep)
        self._spin = add(scale(self._spin, keep), turn, 1.0 - keep)
        self._pose, self._seen_at = pose, at

    def lose(self) -> None:
        """Take it from the source that the bat is lost."""
        self._since = math.inf
        self._seen_at = -math.inf

    def read(self, now: float) -> TrackedBat:
        """Return the bat now, moved on over a short gap."""
        gap = now - self._seen_at
        ahead = min(max(gap, 0.0), EXTRAPOLATED_SECONDS) if gap <= LOST_SECONDS else 0.0
        pose = Pose(
            add(self._pose.position, self._velocity, ahead),
            turned(self._pose.orientation, scale(self._spin, ahead)),
        )
        is_valid = gap <= LOST_SECONDS and now - self._since >= PROVEN_SECONDS
        state = np.array([*pose.position, *pose.orientation, *self._velocity, *self._spin])
        return TrackedBat(state=state, is_valid=is_valid, seen_at=self._seen_at)

    def _jumps(self, pose: Pose, passed: float) -> bool:
        expected = add(self._pose.position, self._velocity, passed)
        turn = length(rotation_between(self._pose.orientation, pose.orientation))
        return (
            distance(pose.position, expected) > JUMP + passed * length(self._velocity)
            or distance(pose.position, self._pose.position) > MAX_SPEED * passed
            or turn > MAX_TURN_SPEED * passed
        )

    def _begin(self, pose: Pose, at: float) -> None:
        self._pose, self._seen_at, self._since = pose, at, at
        self._velocity = self._spin = (0.0, 0.0, 0.0)


class PageTracker:
    """The mouse of a browser: poses that arrive on ``play/tracker``."""

    def __init__(self, bus: Bus, start: Pose) -> None:
        self._poses = bus.subscribe(TRACKER)
        self._follower = Follower(start)
        self._source = ""
        self._sequence = -1

    def read(self, now: float) -> TrackedBat:
        """Return the bat after what has arrived; a new page takes over from an old one."""
        for _ in range(MAX_POSES):
            if (found := self._poses.take()) is None:
                break
            if found.source == self._source and found.sequence <= self._sequence:
                continue
            self._source, self._sequence = found.source, found.sequence
            if not found.is_valid:
                self._follower.lose()
                continue
            x, y, z, *turn = (float(number) for number in found.pose)
            self._follower.offer(Pose((x, y, z), (turn[0], turn[1], turn[2], turn[3])), now)
        return msgspec.structs.replace(
            self._follower.read(now), source=self._source, sequence=self._sequence
        )

    def rates(self) -> dict[str, float]:
        """Return nothing: the page measures itself."""
        return {}

    def counters(self) -> dict[str, int]:
        """Return the poses that were none, or jumps."""
        return {"tracker_rejected": self._follower.rejected}

    def close(self) -> None:
        """Stop listening."""
        self._poses.close()


class _Exact:
    """A tracker that measures nothing and loses nothing."""

    def rates(self) -> dict[str, float]:
        """Return nothing."""
        return {}

    def counters(self) -> dict[str, int]:
        """Return nothing."""
        return {}

    def close(self) -> None:
        """Nothing to let go of."""


class PolicyTracker(_Exact):
    """The robot opposite, which a second policy moves."""

    def __init__(self, robot: OtherRobot) -> None:
        self._robot = robot

    def read(self, now: float) -> TrackedBat:
        """Return the simulated bat, exact and always there."""
        return TrackedBat(state=self._robot.read_other()[0], is_valid=True, seen_at=now)


class ReplayTracker(_Exact):
    """A recorded bat, from the first read on, over and over."""

    def __init__(self, rows: Floats) -> None:
        """Take the recording: float64[T, 14], seconds from the start, then a bat's state."""
        self._times = rows[:, 0] - rows[0, 0]
        self._states = rows[:, 1:]
        self._began_at: float | None = None

    @staticmethod
    def load(path: Path) -> "ReplayTracker":
        """Read a recording: a ``.npy`` file, or the folder of an archived bout.

        Raises:
            ConfigError: it cannot be read, or is no recording of a bat.
        """
        return ReplayTracker(read_replay(path))

    def read(self, now: float) -> TrackedBat:
        """Return the last recorded state before now."""
        if self._began_at is None:
            self._began_at = now
        last = float(self._times[-1])
        passed = math.fmod(now - self._began_at, last)
        row = int(np.searchsorted(self._times, passed + 1e-9, side="right")) - 1
        return TrackedBat(state=self._states[max(row, 0)], is_valid=True, seen_at=now)
