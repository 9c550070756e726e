"""Draws a live bout: every stream as curves at its own rate, and the scene as in training.

Paths, all under ``bout/``: what is drawn is ``SERIES``, and the changes of state in ``events/``.
Rows of the 100 Hz loop lie on ``control_step`` (ticks of robot_io, boots end to end), ``bout_time``
(the same in seconds) and ``wall_time``; the others on ``wall_time`` alone.
"""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import rerun as rr

from shared.messages.message import Array
from shared.messages.training import AGENTS
from shared.telemetry import recording as paths
from shared.telemetry.bout import COLOURS, STILL, TARGET_COLOURS, WORLD
from shared.telemetry.recording import Recording
from shared.telemetry.scene import JOINTS, Scene
from shared.telemetry.streams import (
    ARMS,
    BATS,
    GATE,
    HEART_RATE,
    LINE,
    OFFSETS,
    REFEREE,
    ROBOT,
    TIME,
    TRACKER,
    TRACKER_RAW,
    Rows,
)

XYZ = ("x", "y", "z")
WXYZ = ("w", "x", "y", "z")
PHASE_PATH = f"{paths.EVENTS}/phase"
GATE_PATH = f"{paths.EVENTS}/gate"
LATENESS = "bout/lateness"
HEART_PATH = "bout/heart_rate"
OFFSET = "bout/offset"
TOOL = "bout/tool"
JOINT = "bout/joints"
FORCE = "bout/robot/force"
TONE = "bout/tone"
PERSON_BAT = "person/bat"
"""Frame of the bat that a person holds."""
OUT_OF_SIGHT = (0.0, 0.0, -100.0)
"""Where frames of those who are not there are put (m): a frame cannot be taken away."""
AXIS_COLOURS = ((220, 70, 70), (80, 180, 90), (70, 120, 230))
PHASES = {"running": (80, 180, 90), "paused": (255, 190, 70), "void": (220, 70, 70)}
MODES = {
    "ramping": (255, 225, 120), "armed": (80, 180, 90), "holding": (255, 160, 60),
    "tripped": (220, 70, 70),
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Series:
    """Columns of a stream that are one entity."""

    stream: str
    path: str
    columns: tuple[str, ...]
    labels: tuple[str, ...] = ()
    """Of the curves; as many as there are numbers."""
    kind: Literal["scalars", "pose"] = "scalars"
    only_with: str = ""
    """Column without which (all false) there is nothing to draw."""


def tracked_path(agent: str) -> str:
    """Return the entity that says when a bat is not tracked."""
    return f"{paths.EVENTS}/tracking_{agent}"


def _sided(agent: str) -> tuple[Series, ...]:
    offsets = OFFSETS[agent].name
    there = f"{agent}_is_there"
    return (
        Series(BATS.name, f"bout/bat/{agent}", (f"{agent}_position", f"{agent}_orientation"),
               kind="pose"),
        Series(BATS.name, f"bout/bat/{agent}/is_valid", (f"{agent}_is_valid",)),
        Series(BATS.name, f"bout/bat/{agent}/velocity", (f"{agent}_velocity",), XYZ),
        Series(BATS.name, f"{TOOL}/{agent}/measured", (f"{agent}_tool_position",),
               tuple(f"{axis} measured" for axis in XYZ)),
        Series(ARMS.name, f"{JOINT}/{agent}/position", (f"{agent}_joint_positions",), JOINTS,
               only_with=there),
        Series(ARMS.name, f"{JOINT}/{agent}/velocity", (f"{agent}_joint_velocities",), JOINTS,
               only_with=there),
        Series(offsets, f"{OFFSET}/{agent}/translation", ("translation",), XYZ),
        Series(offsets, f"{OFFSET}/{agent}/rotation", ("rotation",), XYZ),
        Series(offsets, f"{LATENESS}/policy_{agent}", ("took_ms",), (f"{agent}'s policy",)),
    )  # fmt: skip


SERIES: tuple[Series, ...] = (
    *(series for agent in AGENTS for series in _sided(agent)),
    Series(GATE.name, f"{TOOL}/protagonist/commanded", ("commanded_position",),
           tuple(f"{axis} commanded" for axis in XYZ)),
    Series(GATE.name, "bout/command/orientation", ("commanded_orientation",), WXYZ),
    Series(GATE.name, "bout/command/is_sent", ("is_sent",), ("sent",)),
    Series(GATE.name, "bout/command/is_clipped", ("is_clipped",), ("clipped",)),
    Series(GATE.name, f"{LATENESS}/robot_io", ("lateness_ms",), ("robot_io",)),
    Series(GATE.name, f"{LATENESS}/command", ("answer_ms",), ("states to command",)),
    Series(ROBOT.name, FORCE, ("force",), ("force on the tool",)),
    Series(ROBOT.name, "bout/robot/effort_share", ("effort_share",), ("largest effort",)),
    Series(ROBOT.name, "bout/robot/efforts", ("efforts",), JOINTS),
    Series(REFEREE.name, paths.BOUT_SCORE, ("score",), ("antagonist's score",)),
    Series(REFEREE.name, "bout/points", ("points",), ("points of a step",)),
    Series(REFEREE.name, TONE, ("tone_hz",), ("tone",)),
    Series(TRACKER.name, "bout/tracker", ("position", "orientation"), kind="pose"),
    Series(TRACKER.name, "bout/tracker/is_valid", ("is_valid",)),
    Series(TRACKER_RAW.name, "bout/tracker_raw", ("position", "orientation"), kind="pose"),
    Series(HEART_RATE.name, HEART_PATH, ("beats_per_minute",), ("heart rate",)),
)  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Blade:
    """A bat, along the x axis of its frame (m)."""

    back: float
    front: float
    radius: float


def draw_live_scene(recording: Recording, blade: Blade) -> None:
    """Log what never changes and training's scene has not: a person's bat, and how curves look."""
    half = np.sqrt(0.5)  # a Rerun capsule lies along z
    bat = rr.Capsules3D(
        radii=[blade.radius], lengths=[blade.front - blade.back],
        translations=[(blade.back, 0.0, 0.0)], quaternions=[rr.Quaternion(xyzw=(0, half, 0, half))],
        colors=[COLOURS["antagonist"]], fill_mode="solid",
    )  # fmt: skip
    recording.static(f"{paths.SCENE}/person/bat", bat, rr.CoordinateFrame(PERSON_BAT))
    for series in SERIES:
        if series.labels and series.path != paths.BOUT_SCORE:
            colours = AXIS_COLOURS if len(series.labels) == len(XYZ) else None
            style = rr.SeriesLines(names=list(series.labels), colors=colours)
            recording.static(series.path, style)
    states = {PHASE_PATH: PHASES, GATE_PATH: MODES}
    states |= {tracked_path(agent): {"lost": (220, 70, 70)} for agent in AGENTS}
    for path, values in states.items():
        colours = [*values.values()]
        look = rr.StateConfiguration(values=[*values], labels=[*values], colors=colours)
        recording.static(path, look)


class LiveDrawer:
    """Sends rows of a live bout to one place, states only where they change."""

    def __init__(self, recording: Recording, scene: Scene, to: Literal["file", "live"]) -> None:
        self._recording = recording
        self._scene = scene
        self._to: Literal["file", "live"] = to
        self._poses: Array | None = None
        self._states: dict[str, str] = {}

    def curves(self, rows: Mapping[str, Rows]) -> None:
        """Send every row of every stream.

        Args:
            rows: by stream, as they were heard.
        """
        for series in SERIES:
            found = rows.get(series.stream)
            if found is None or (series.only_with and not found[series.only_with].any()):
                continue
            times = self._times(found)
            if series.kind == "pose":
                position, turn = (found[name] for name in series.columns)
                xyzw = turn[:, [1, 2, 3, 0]]
                columns = rr.Transform3D.columns(translation=position, quaternion=xyzw)
            else:
                columns = _scalars(found, series)
            self._recording.columns(self._to, series.path, times, columns)

    def bodies(self, arms: Rows, positions: Array, quaternions: Array) -> None:
        """Send the poses of all bodies; those of a side that no robot plays are out of sight.

        Args:
            arms: F rows of joints.
            positions: float32[F, B, 3] (m), of these joints.
            quaternions: float32[F, B, 4], w x y z.
        """
        names = self._scene.body_names
        placed = positions.copy()
        for agent in AGENTS:
            ours = np.array([name.startswith(f"{agent}/") for name in names])
            absent: Array = ~arms[f"{agent}_is_there"]
            placed[absent[:, None] & ours[None]] = OUT_OF_SIGHT
        poses = np.concatenate([placed, quaternions], axis=2)
        before = poses[:1] if self._poses is None else self._poses[None]
        moved: Array = np.any(np.abs(poses - before) > STILL, axis=(0, 2))
        self._poses = poses[-1]
        bodies = [b for b, name in enumerate(names) if name != WORLD]
        pairs = [(k, b) for k in range(len(arms)) for b in bodies if k == 0 or moved[b]]
        row, body = (np.array(index) for index in zip(*pairs, strict=True))
        columns = rr.Transform3D.columns(
            translation=placed[row, body],
            quaternion=quaternions[row, body][:, [1, 2, 3, 0]],
            child_frame=[names[b] for _, b in pairs],
        )
        times = self._times(arms.pick(row))
        self._recording.columns(self._to, paths.POSES, times, columns)

    def person(self, bats: Rows, *, is_there: bool) -> None:
        """Send where the antagonist's bat is, if a person holds it.

        Args:
            bats: F rows of bat states.
            is_there: whether a person plays.
        """
        rows = bats if is_there else bats.pick(slice(0, 1))
        agent = AGENTS[0]
        position, turn = rows[f"{agent}_position"], rows[f"{agent}_orientation"]
        if not is_there:
            position = np.array([OUT_OF_SIGHT])
        columns = rr.Transform3D.columns(
            translation=position,
            quaternion=turn[:, [1, 2, 3, 0]],
            child_frame=[PERSON_BAT] * len(rows),
        )
        self._recording.columns(self._to, paths.POSES, self._times(rows), columns)

    def states(self, rows: Mapping[str, Rows]) -> None:
        """Send where phase, gate, tracking, in target, contact and the target's colour change.

        Args:
            rows: by stream; all of them, for a touch may last one row.
        """
        if (said := rows.get(REFEREE.name)) is not None:
            phase = np.where(np.isin(said["phase"], [*PHASES]), said["phase"], "")
            self._state(PHASE_PATH, said, phase)
            inside = [said[f"{agent}_in_target"] for agent in AGENTS]
            for agent, is_inside in zip(AGENTS, inside, strict=True):
                state = np.where(is_inside, "in target", "")
                self._state(paths.in_target_path(agent), said, state)
            touch = np.where(said["contact"], "touch", "")
            self._state(paths.CONTACT, said, touch)
            self._target(said, inside)
        if (gate := rows.get(GATE.name)) is not None:
            mode = np.where(np.isin(gate["mode"], [*MODES]), gate["mode"], "")
            self._state(GATE_PATH, gate, mode)
        if (bats := rows.get(BATS.name)) is not None:
            for agent in AGENTS:
                state = np.where(bats[f"{agent}_is_valid"], "", "lost")
                self._state(tracked_path(agent), bats, state)

    def _target(self, said: Rows, inside: Sequence[Array]) -> None:
        state = np.select(
            [inside[0] & said["contact"], inside[0], inside[1]],
            ["penalty", "scores", "guarded"],
            "free",
        )
        if kept := self._changes(paths.TARGET, state):
            colours = [TARGET_COLOURS[str(state[k])] for k in kept]
            times = self._times(said.pick(np.array(kept)))
            columns = rr.Ellipsoids3D.columns(colors=colours)
            self._recording.columns(self._to, paths.TARGET, times, columns)

    def _state(self, path: str, rows: Rows, state: Array) -> None:
        if kept := self._changes(path, state):
            columns = rr.StateChange.columns(state=[str(state[k]) for k in kept])
            times = self._times(rows.pick(np.array(kept)))
            self._recording.columns(self._to, path, times, columns)

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

    def _times(self, rows: Rows) -> list[rr.TimeColumn]:
        wall = rr.TimeColumn(paths.WALL_TIME, timestamp=rows[TIME].astype("datetime64[ns]"))
        if LINE not in rows.columns:
            return [wall]
        steps = rows[LINE]
        return [
            rr.TimeColumn(paths.CONTROL_STEP, sequence=steps),
            rr.TimeColumn(paths.BOUT_TIME, duration=steps * self._scene.control_timestep),
            wall,
        ]


def _scalars(rows: Rows, series: Series) -> Any:
    found = [rows[name].astype(np.float64).reshape(len(rows), -1) for name in series.columns]
    values = np.concatenate(found, axis=1)
    return rr.Scalars.columns(scalars=values if values.shape[1] > 1 else values[:, 0])
