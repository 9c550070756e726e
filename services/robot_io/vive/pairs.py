"""Pairs of poses for a calibration: tracker and tool at once, while both stand still."""

from collections import deque
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Which = Literal["tracker", "tool"]

STILL_SECONDS = 0.5
"""How long both must stand still."""
DRIFT_M = 0.001
DRIFT_RAD = 0.004
"""Between the means of the first and the second half of that time."""
SHAKE_M = 0.003
"""Of a tracker's noise (RMS)."""
LEAST_SAMPLES = 20
GAP_SECONDS = 0.1
"""A stream that was silent for longer has to begin again."""
APART_M = 0.03
APART_RAD = 0.14
"""A pose nearer than both of these to one taken already tells nothing new."""
MAX_SAMPLES = 512


class Pair(NamedTuple):
    """Where tracker and tool were at once; means over the time they stood still."""

    tracker: Floats
    """float64[7], in the base stations' frame: position (m), orientation (w x y z)."""
    tool: Floats
    """float64[7], in the robot's torso frame."""


class Still:
    """Poses of one thing, and where it stands if it does."""

    def __init__(self) -> None:
        self._poses: deque[tuple[float, Floats]] = deque(maxlen=MAX_SAMPLES)

    def offer(self, pose: Floats, at: float) -> None:
        """Take float64[7], seen at an instant."""
        if self._poses and at - self._poses[-1][0] > GAP_SECONDS:
            self._poses.clear()
        self._poses.append((at, pose))
        while len(self._poses) > 1 and at - self._poses[1][0] >= STILL_SECONDS:
            self._poses.popleft()

    def lose(self) -> None:
        """Forget everything: it was out of sight, or has been taken."""
        self._poses.clear()

    def place(self, now: float) -> Floats | None:
        """Return the mean pose, float64[7], if it has stood still for long enough."""
        if len(self._poses) < LEAST_SAMPLES or now - self._poses[-1][0] > GAP_SECONDS:
            return None
        if self._poses[-1][0] - self._poses[0][0] < STILL_SECONDS:
            return None
        poses: Floats = np.array([pose for _, pose in self._poses])
        half = len(poses) // 2
        early, late, mean = mean_of(poses[:half]), mean_of(poses[half:]), mean_of(poses)
        shake = float(np.linalg.norm(poses[:, :3] - mean[:3])) / len(poses) ** 0.5
        shift, turn = apart(early, late)
        is_still = shift <= DRIFT_M and turn <= DRIFT_RAD and shake <= SHAKE_M
        return mean if is_still else None


class PairCollector:
    """Takes a pair each time that tracker and tool stand still where they did not before."""

    def __init__(self) -> None:
        self._still: dict[Which, Still] = {"tracker": Still(), "tool": Still()}
        self.pairs: list[Pair] = []
        self.is_alike = False
        """Whether both stand still at a place that is taken already."""

    def offer(self, which: Which, pose: Floats, at: float) -> None:
        """Take float64[7] of one of the two, seen at an instant."""
        self._still[which].offer(pose, at)

    def lose(self, which: Which) -> None:
        """Take it that one of them is out of sight."""
        self._still[which].lose()

    def take(self, now: float) -> Pair | None:
        """Return a new pair, which is kept too; None while there is none."""
        self.is_alike = False
        tool = self._still["tool"].place(now)
        if tool is None or (tracker := self._still["tracker"].place(now)) is None:
            return None
        for pair in self.pairs:
            shift, turn = apart(pair.tool, tool)
            if shift < APART_M and turn < APART_RAD:
                self.is_alike = True
                return None
        pair = Pair(tracker, tool)
        self.pairs.append(pair)
        for still in self._still.values():
            still.lose()
        return pair

    def arrays(self) -> tuple[Floats, Floats]:
        """Return float64[N, 7] of the trackers and of the tools."""
        return (
            np.array([pair.tracker for pair in self.pairs]).reshape(-1, 7),
            np.array([pair.tool for pair in self.pairs]).reshape(-1, 7),
        )


def mean_of(poses: Floats) -> Floats:
    """Return the mean of float64[N, 7] that are close together."""
    turns = poses[:, 3:] * np.sign(poses[:, 3:] @ poses[0, 3:])[:, None]
    mean = turns.mean(axis=0)
    return np.concatenate([poses[:, :3].mean(axis=0), mean / np.linalg.norm(mean)])


def apart(one: Floats, other: Floats) -> tuple[float, float]:
    """Return how far two poses are apart (m) and how far they are turned (rad)."""
    # From the chord, not the cosine: near 1 that one loses half its digits.
    chord = min(
        float(np.linalg.norm(one[3:] - other[3:])), float(np.linalg.norm(one[3:] + other[3:]))
    )
    turn = 4.0 * np.arcsin(min(0.5 * chord, 1.0))
    return float(np.linalg.norm(one[:3] - other[:3])), float(turn)
