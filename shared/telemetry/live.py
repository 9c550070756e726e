"""Draws a live bout: every stream as curves at its own rate, and the scene as in training.

Paths, all under ``bout/``: what is drawn is ``SERIES``, and the changes of state in ``events/``.
Rows of the 100 Hz loop lie on ``control_step`` (ticks of robot_io, boots end to end), ``bout_time``
(the same in seconds) and ``wall_time``; the others on ``wall_time`` alone.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
import rerun as rr

from shared.messages.message import Array
from shared.messages.training import AGENTS
from shared.telemetry import recording as paths
from shared.telemetry.bout import COLOURS
from shared.telemetry.drawer import ALL, Drawer, TimesOf, loop_times, wall_times
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
        self._drawer = Drawer(recording, scene, to)
        self._scene = scene

    def curves(self, rows: Mapping[str, Rows]) -> None:
        """Send every row of every stream.

        Args:
            rows: by stream, as they were heard.
        """
        for series in SERIES:
            found = rows.get(series.stream)
            if found is None or (series.only_with and not found[series.only_with].any()):
                continue
            if series.kind == "pose":
                position, turn = (found[name] for name in series.columns)
                xyzw = turn[:, [1, 2, 3, 0]]
                columns = rr.Transform3D.columns(translation=position, quaternion=xyzw)
            else:
                columns = _scalars(found, series)
            self._drawer.send(series.path, self._times(found)(ALL), columns)

    def bodies(self, arms: Rows, positions: Array, quaternions: Array) -> None:
        """Send the poses of all bodies; those of a side that no robot plays are out of sight.

        Args:
            arms: F rows of joints.
            positions: float32[F, B, 3] (m), of these joints.
            quaternions: float32[F, B, 4], w x y z.
        """
        placed = positions.copy()
        for agent in AGENTS:
            ours = np.array([name.startswith(f"{agent}/") for name in self._scene.body_names])
            absent: Array = ~arms[f"{agent}_is_there"]
            placed[absent[:, None] & ours[None]] = OUT_OF_SIGHT
        self._drawer.bodies(self._times(arms), placed, quaternions)

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
        self._drawer.send(paths.POSES, self._times(rows)(ALL), columns)

    def states(self, rows: Mapping[str, Rows]) -> None:
        """Send where phase, gate, tracking, in target, contact and the target's colour change.

        Args:
            rows: by stream; all of them, for a touch may last one row.
        """
        drawer = self._drawer
        if (said := rows.get(REFEREE.name)) is not None:
            times = self._times(said)
            phase = np.where(np.isin(said["phase"], [*PHASES]), said["phase"], "")
            drawer.state(PHASE_PATH, times, phase)
            inside = [said[f"{agent}_in_target"] for agent in AGENTS]
            for agent, is_inside in zip(AGENTS, inside, strict=True):
                state = np.where(is_inside, "in target", "")
                drawer.state(paths.in_target_path(agent), times, state)
            drawer.state(paths.CONTACT, times, np.where(said["contact"], "touch", ""))
            drawer.target(times, inside[0], inside[1], said["contact"])
        if (gate := rows.get(GATE.name)) is not None:
            mode = np.where(np.isin(gate["mode"], [*MODES]), gate["mode"], "")
            drawer.state(GATE_PATH, self._times(gate), mode)
        if (bats := rows.get(BATS.name)) is not None:
            for agent in AGENTS:
                state = np.where(bats[f"{agent}_is_valid"], "", "lost")
                drawer.state(tracked_path(agent), self._times(bats), state)

    def _times(self, rows: Rows) -> TimesOf:
        def times(kept: Array | slice) -> list[rr.TimeColumn]:
            wall_ns = rows[TIME][kept]
            if LINE not in rows.columns:
                return [wall_times(wall_ns)]
            return loop_times(rows[LINE][kept], wall_ns, self._scene.control_timestep)

        return times


def _scalars(rows: Rows, series: Series) -> Any:
    found = [rows[name].astype(np.float64).reshape(len(rows), -1) for name in series.columns]
    values = np.concatenate(found, axis=1)
    return rr.Scalars.columns(scalars=values if values.shape[1] > 1 else values[:, 0])
