"""The recording of `riposte identify`: measured and simulated arms overlaid, residuals as curves.

Everything is on one timeline, ``time``: trajectories lie end to end on it, and ``trajectory`` says
which one it is. Poses are rows that name the body's frame, as in ``shared.telemetry.drawer``.
"""

# pyright: basic
# (rerun's types are partial)

import dataclasses
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from shared.errors import RiposteError
from shared.telemetry.recording import APPLICATION
from shared.telemetry.rrd import RecordingFile, compact
from shared.telemetry.scene import Fixed

Floats = NDArray[np.float64]
TIME = "time"
ARMS = "arms"
RESIDUAL = "residual"
MOTION = "motion"
TRAJECTORY = "trajectory"
LEFT = "unexplained"
SUMMARY = "verdict"
STAGE_COLOURS = {
    "nominal": (140, 148, 160),
    "base_fit": (232, 93, 54),
    "extended": (64, 132, 214),
    "measured": (40, 44, 52),
}
STILL = 1e-6
"""A body that moves less (m, or quaternion) stands still."""
GHOST = 120
"""Opacity of a simulated arm, of 255."""
SHADES = ((120, 160, 200), (160, 200, 150), (210, 180, 120), (190, 150, 200))
"""Of trajectories, in turn."""
CURVES_SHOWN = 6
"""Joints that are not in a tab behind."""


class Solid(Fixed, Protocol):
    """A primitive or a mesh; the simulator's fits as it is."""

    @property
    def kind(self) -> str:
        """Return what it is; long ones lie along their own z."""
        ...

    @property
    def vertices(self) -> NDArray[np.float32] | None:
        """Return float32[V, 3] of a mesh (m)."""
        ...

    @property
    def faces(self) -> NDArray[np.int32] | None:
        """Return int32[F, 3] of a mesh."""
        ...


@dataclasses.dataclass(frozen=True)
class Poses:
    """Where the bodies of one arm were."""

    at: Floats
    """float64[F] (s), trajectories end to end."""
    positions: NDArray[np.float32]
    """float32[F, B, 3] (m)."""
    quaternions: NDArray[np.float32]
    """float32[F, B, 4], w x y z."""


@dataclasses.dataclass(frozen=True)
class Curves:
    """Curves of one channel that share a view; NaN breaks a curve."""

    name: str
    units: tuple[str, str]
    """Of the motion and of the residual."""
    at: Floats
    """float64[T] (s), trajectories end to end."""
    motion: Mapping[str, Floats]
    """float64[T] by stage, and ``measured``; empty where there is none."""
    residual: Mapping[str, Floats]
    """float64[T] by stage."""


@dataclasses.dataclass(frozen=True)
class Span:
    """Something that lasts."""

    name: str
    begin: float
    """(s), trajectories end to end."""
    end: float


@dataclasses.dataclass(frozen=True)
class Overlay:
    """What is recorded."""

    name: str
    bodies: Sequence[str]
    solids: Sequence[Solid]
    arms: Mapping[str, Poses]
    """By ``measured`` and stage."""
    curves: Sequence[Curves]
    trajectories: Sequence[Span]
    unexplained: Sequence[Span]
    markdown: str


def write_overlay_recording(path: Path, overlay: Overlay) -> None:
    """Write the recording, whole or not at all.

    Raises:
        RiposteError: it cannot be written.
    """
    stream = rr.RecordingStream(APPLICATION, recording_id=f"identify-{overlay.name}")
    memory = stream.binary_stream()
    stream.send_recording_name(f"identify {overlay.name}")
    stream.send_blueprint(_layout(overlay))
    words = rr.TextDocument(overlay.markdown, media_type=rr.MediaType.MARKDOWN)
    stream.log(SUMMARY, words, static=True)
    stream.log(ARMS, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for arm, poses in overlay.arms.items():
        _arm(stream, overlay, arm, poses)
    for curves in overlay.curves:
        _curves(stream, MOTION, curves, curves.motion)
        _curves(stream, RESIDUAL, curves, curves.residual)
    _spans(stream, TRAJECTORY, overlay.trajectories, SHADES)
    _spans(stream, LEFT, overlay.unexplained, ((220, 70, 70),))
    content = memory.read(flush=True) or b""
    stream.disconnect()
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.unlink(missing_ok=True)
        file = RecordingFile(temporary)
        try:
            file.write(content)
        finally:
            file.close()
        compact(temporary)
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise RiposteError(f"{path} cannot be written ({error.strerror})") from error


def path_of(kind: str, name: str) -> str:
    """Return the entity of a channel; whatever it is called it is one part of the path."""
    return f"{kind}/{rr.escape_entity_path_part(name)}"


def _unit(kind: str, curves: Curves) -> str:
    return curves.units[1 if kind == RESIDUAL else 0]


def _arm(stream: rr.RecordingStream, overlay: Overlay, arm: str, poses: Poses) -> None:
    frames = [f"{arm}/{name}" for name in overlay.bodies]
    moves = np.ptp(poses.positions, axis=0).max(axis=1) + np.ptp(poses.quaternions, axis=0).max(
        axis=1
    )
    for number, solid in enumerate(overlay.solids):
        if arm != "measured" and moves[solid.body] < STILL:
            continue  # it would only hide the measured one
        entity = f"{ARMS}/{arm}/solid/{number}"
        stream.log(entity, *_solid(solid, arm), rr.CoordinateFrame(frames[solid.body]), static=True)
    count = len(overlay.bodies)
    rows = np.repeat(np.arange(len(poses.at)), count)
    columns = rr.Transform3D.columns(
        translation=poses.positions.reshape(-1, 3),
        quaternion=poses.quaternions.reshape(-1, 4)[:, [1, 2, 3, 0]],
        child_frame=frames * len(poses.at),
    )
    stream.send_columns(
        f"{ARMS}/{arm}/poses", indexes=[rr.TimeColumn(TIME, duration=poses.at[rows])],
        columns=columns,
    )  # fmt: skip


def _solid(solid: Solid, arm: str) -> tuple[Any, ...]:
    """Return the archetypes of a solid in its body's frame; simulated arms are see-through."""
    colour = tuple(round(255 * value) for value in solid.rgba)
    if arm != "measured":
        colour = (*STAGE_COLOURS[arm], GHOST)
    w, x, y, z = solid.quaternion
    turn = rr.Quaternion(xyzw=(x, y, z, w))
    place: dict[str, Any] = {"quaternions": [turn], "colors": [colour], "fill_mode": "solid"}
    size, centre = list(solid.size), solid.position
    if solid.vertices is not None and solid.faces is not None:
        mesh = rr.Mesh3D(
            vertex_positions=solid.vertices, triangle_indices=solid.faces, albedo_factor=colour
        )
        return mesh, rr.InstancePoses3D(translations=[centre], quaternions=[turn])
    if solid.kind == "box":
        return (rr.Boxes3D(half_sizes=[size], centers=[centre], **place),)
    if solid.kind in ("sphere", "ellipsoid"):
        half = size * 3 if solid.kind == "sphere" else size
        return (rr.Ellipsoids3D(half_sizes=[half], centers=[centre], **place),)
    if solid.kind == "cylinder":
        return (rr.Cylinders3D(radii=[size[0]], lengths=[2 * size[1]], centers=[centre], **place),)
    # A Rerun capsule starts at its place and goes along +z; ours is centred.
    along = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    start = np.asarray(centre) - size[1] * along
    return (rr.Capsules3D(radii=[size[0]], lengths=[2 * size[1]], translations=[start], **place),)


def _curves(
    stream: rr.RecordingStream, kind: str, curves: Curves, values: Mapping[str, Floats]
) -> None:
    if not values:
        return
    path = path_of(kind, curves.name)
    names = [f"{curves.name} {stage.replace('_', ' ')} ({_unit(kind, curves)})" for stage in values]
    colours = [STAGE_COLOURS[stage] for stage in values]
    stream.log(path, rr.SeriesLines(names=names, colors=colours, widths=1.5), static=True)
    stacked = np.stack([*values.values()], axis=1)
    stream.send_columns(
        path, indexes=[rr.TimeColumn(TIME, duration=curves.at)],
        columns=rr.Scalars.columns(scalars=stacked if stacked.shape[1] > 1 else stacked[:, 0]),
    )  # fmt: skip


def _spans(
    stream: rr.RecordingStream, path: str, spans: Sequence[Span],
    shades: Sequence[tuple[int, int, int]],
) -> None:  # fmt: skip
    if not spans:
        return
    names = list(dict.fromkeys(span.name for span in spans))
    colours = [shades[k % len(shades)] for k in range(len(names))]
    look = rr.StateConfiguration(values=names, labels=names, colors=colours)
    stream.log(path, look, static=True)
    changes = [(span.begin, span.name) for span in spans] + [(span.end, "") for span in spans]
    changes.sort(key=lambda change: (change[0], change[1] != ""))
    stream.send_columns(
        path, indexes=[rr.TimeColumn(TIME, duration=np.array([at for at, _ in changes]))],
        columns=rr.StateChange.columns(state=[state for _, state in changes]),
    )  # fmt: skip


def _layout(overlay: Overlay) -> rrb.Blueprint:
    def plots(kind: str, curves: Sequence[Curves]) -> rrb.Vertical:
        views = [
            rrb.TimeSeriesView(
                origin=path_of(kind, each.name), name=f"{each.name} ({_unit(kind, each)})"
            )
            for each in curves
        ]
        return rrb.Vertical(*views, name=kind.capitalize())

    first, rest = overlay.curves[:CURVES_SHOWN], overlay.curves[CURVES_SHOWN:]
    with_motion = [each for each in first if each.motion]
    tabs = [plots(RESIDUAL, first)]
    tabs += [plots(MOTION, with_motion)] if with_motion else []
    tabs += [rrb.Vertical(*plots(RESIDUAL, rest).contents, name="Others")] if rest else []
    arms = rrb.Spatial3DView(origin=ARMS, name="Measured (solid) and simulated (see-through)")
    lanes = rrb.StateTimelineView(origin="/", contents=[TRAJECTORY, LEFT], name="Recordings")
    words = rrb.TextDocumentView(origin=SUMMARY, name="Verdict")
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(arms, lanes, words, row_shares=[4, 1, 1]),
            rrb.Tabs(*tabs, active_tab=0),
            column_shares=[1.2, 1],
        ),
        rrb.TimePanel(timeline=TIME, state="collapsed", play_state="playing"),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        auto_views=False,
    )
