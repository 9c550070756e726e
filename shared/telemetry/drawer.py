"""Sends poses and states of a bout to one place, leaving out what has not changed since."""

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import rerun as rr

from shared.messages.message import Array
from shared.telemetry import recording as paths
from shared.telemetry.recording import Recording
from shared.telemetry.scene import Scene

TARGET_COLOURS = {
    "free": (255, 190, 70, 70),
    "scores": (60, 210, 110, 130),
    "penalty": (235, 40, 60, 150),
    "guarded": (64, 132, 214, 110),
}
"""The target's colour says what the rule book makes of this instant."""
WORLD = "world"
"""The body that everything stands on."""
STILL = 1e-5
"""A pose that changed less than this (m, or quaternion) is not sent again."""
ALL = slice(None)
"""Every row."""

TimesOf = Callable[[Array | slice], list[rr.TimeColumn]]
"""Returns the times of some rows, by their numbers."""


def wall_times(wall_ns: Array) -> rr.TimeColumn:
    """Return when rows held by the wall clock: int64[F] (ns)."""
    return rr.TimeColumn(paths.WALL_TIME, timestamp=wall_ns.astype("datetime64[ns]"))


def loop_times(steps: Array, wall_ns: Array, control_timestep: float) -> list[rr.TimeColumn]:
    """Return when rows of a control loop held, on its three timelines.

    Args:
        steps: int64[F], control steps, bouts end to end.
        wall_ns: int64[F], the wall clock (ns).
        control_timestep: from one step to the next (s).
    """
    return [
        rr.TimeColumn(paths.CONTROL_STEP, sequence=steps),
        rr.TimeColumn(paths.BOUT_TIME, duration=steps * control_timestep),
        wall_times(wall_ns),
    ]


class Drawer:
    """Knows what one place was sent last."""

    def __init__(self, recording: Recording, scene: Scene, to: Literal["file", "live"]) -> None:
        self._recording = recording
        self._names = scene.body_names
        self._to: Literal["file", "live"] = to
        self._poses: Array | None = None
        self._states: dict[str, str] = {}

    def send(self, path: str, times: list[rr.TimeColumn], columns: Any) -> None:
        """Send rows as they are."""
        self._recording.columns(self._to, path, times, columns)

    def bodies(self, times: TimesOf, positions: Array, quaternions: Array) -> None:
        """Send all poses as one chunk: a row names its body's frame, as robots' ``tf`` does.

        A chunk for each body would cost the viewer ten times as much to take in.

        Args:
            times: of the rows.
            positions: float32[F, B, 3] (m).
            quaternions: float32[F, B, 4], w x y z.
        """
        poses = np.concatenate([positions, quaternions], axis=2)
        before = poses[:1] if self._poses is None else self._poses[None]
        moved: Array = np.any(np.abs(poses - before) > STILL, axis=(0, 2))
        self._poses = poses[-1]
        bodies = [b for b, name in enumerate(self._names) if name != WORLD]
        # Once a batch for those at rest, too: a viewer that comes late must find them.
        pairs = [(k, b) for k in range(len(poses)) for b in bodies if k == 0 or moved[b]]
        row, body = (np.array(index) for index in zip(*pairs, strict=True))
        columns = rr.Transform3D.columns(
            translation=positions[row, body],
            quaternion=quaternions[row, body][:, [1, 2, 3, 0]],
            child_frame=[self._names[b] for _, b in pairs],
        )
        self.send(paths.POSES, times(row), columns)

    def state(self, path: str, times: TimesOf, state: Array) -> None:
        """Send a state where it changes: str[F]."""
        if kept := self._changes(path, state):
            columns = rr.StateChange.columns(state=[str(state[k]) for k in kept])
            self.send(path, times(np.array(kept)), columns)

    def target(self, times: TimesOf, inside: Array, guarded: Array, contact: Array) -> None:
        """Send the target's colour where it changes.

        Args:
            times: of the rows.
            inside: bool[F], the antagonist's bat is in the target.
            guarded: bool[F], the protagonist's is.
            contact: bool[F], the bats touch.
        """
        state = np.select(
            [inside & contact, inside, guarded], ["penalty", "scores", "guarded"], "free"
        )
        if kept := self._changes(paths.TARGET, state):
            colours = [TARGET_COLOURS[str(state[k])] for k in kept]
            self.send(paths.TARGET, times(np.array(kept)), rr.Ellipsoids3D.columns(colors=colours))

    def _changes(self, path: str, state: Array) -> list[int]:
        """Return the rows at which the state differs from the one before."""
        last = self._states.get(path)
        kept: list[int] = []
        for k, value in enumerate(state.tolist()):
            if value != last:
                last = value
                kept.append(k)
        self._states[path] = last or ""
        return kept
