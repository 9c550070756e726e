"""Draws the scene once and a bout as it is played: one transform per moving body and instant."""

import dataclasses
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import rerun as rr

from shared.messages.message import Array
from shared.telemetry import recording as paths
from shared.telemetry.drawer import ALL, TARGET_COLOURS, WORLD, Drawer, TimesOf, loop_times
from shared.telemetry.recording import Recording
from shared.telemetry.scene import JOINTS, Scene, Shape

COLOURS = {"antagonist": (232, 93, 54), "protagonist": (64, 132, 214)}
"""Who is who, in every view and figure."""
BATS_COLOUR = (170, 100, 200)
FLOOR_COLOUR = (58, 62, 72)
JOINTS_EVERY = 2
"""Joint angles are for the file only, and there in every second row: the poses say the rest."""


@dataclasses.dataclass(frozen=True)
class BoutRows:
    """F instants of the shown bout, with the times they are shown at."""

    control_step: Array
    """int64[F], bouts end to end."""
    wall_ns: Array
    """int64[F]."""
    positions: Array
    """float32[F, B, 3] (m)."""
    quaternions: Array
    """float32[F, B, 4], w x y z."""
    joints: Array
    """float32[F, 2, 7] (rad)."""
    score: Array
    """float32[F]."""
    in_target: Array
    """bool[F, 2]."""
    contact: Array
    """bool[F]."""

    def __len__(self) -> int:
        return len(self.control_step)

    @staticmethod
    def join(parts: "Sequence[BoutRows]") -> "BoutRows":
        """Return the rows of all parts, in order."""
        names = [field.name for field in dataclasses.fields(BoutRows)]
        return BoutRows(
            **{name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
        )


def draw_scene(recording: Recording, scene: Scene) -> None:
    """Log what never changes: the shapes of every body, the target, and how curves look."""
    recording.static(paths.SCENE, rr.ViewCoordinates.RIGHT_HAND_Z_UP)
    for shape in scene.shapes:
        body, name = scene.body_names[shape.body], shape.name.rsplit("/", 1)[-1]
        if name == "target":
            continue
        colour = FLOOR_COLOUR if name == "floor" else tuple(round(255 * x) for x in shape.rgba)
        frame = [] if body == WORLD else [rr.CoordinateFrame(body)]
        recording.static(paths.shape_path(body, name), _solid(shape, colour), *frame)
    recording.static(
        paths.TARGET,
        rr.Ellipsoids3D(
            centers=[scene.target_centre],
            half_sizes=[[scene.target_radius] * 3],
            colors=[TARGET_COLOURS["free"]],
            fill_mode="solid",
        ),
    )
    recording.static(
        paths.BOUT_SCORE,
        rr.SeriesLines(names="antagonist's score", colors=COLOURS["antagonist"], widths=2),
    )
    for agent in scene.agents:
        red, green, blue = COLOURS[agent]
        recording.static(
            paths.score_path(agent),
            rr.SeriesLines(
                names=[f"{agent} learns", "95 % low", "95 % high"],
                colors=[(red, green, blue, 255), *[(red, green, blue, 90)] * 2],
                widths=[2.5, 1.0, 1.0],
            ),
        )
        for metric in paths.LEARNING_CURVES:
            style = rr.SeriesLines(names=agent, colors=COLOURS[agent], widths=1.5)
            recording.static(paths.training_path(metric, agent), style)
        recording.static(
            paths.version_path(agent), rr.SeriesLines(names=agent, colors=COLOURS[agent])
        )
        recording.static(
            paths.in_target_path(agent),
            rr.StateConfiguration(
                values=["in target"], labels=["in target"], colors=[COLOURS[agent]]
            ),
        )
    recording.static(
        paths.CONTACT,
        rr.StateConfiguration(values=["touch"], labels=["touch"], colors=[BATS_COLOUR]),
    )


class BoutDrawer:
    """Sends rows of bouts to one place, leaving out what has not changed since the last rows."""

    def __init__(self, recording: Recording, scene: Scene, to: Literal["file", "live"]) -> None:
        self._drawer = Drawer(recording, scene, to)
        self._scene = scene
        self._has_joints = to == "file"

    def draw(self, rows: BoutRows) -> None:
        """Send F rows; F may be 0."""
        if len(rows) == 0:
            return

        def times(kept: Array | slice) -> list[rr.TimeColumn]:
            steps, wall_ns = rows.control_step[kept], rows.wall_ns[kept]
            return loop_times(steps, wall_ns, self._scene.control_timestep)

        drawer = self._drawer
        drawer.bodies(times, rows.positions, rows.quaternions)
        drawer.send(paths.BOUT_SCORE, times(ALL), rr.Scalars.columns(scalars=rows.score))
        for a, agent in enumerate(self._scene.agents):
            if self._has_joints:
                self._joints(rows, times, a, agent)
            inside = np.where(rows.in_target[:, a], "in target", "")
            drawer.state(paths.in_target_path(agent), times, inside)
        drawer.state(paths.CONTACT, times, np.where(rows.contact, "touch", ""))
        drawer.target(times, rows.in_target[:, 0], rows.in_target[:, 1], rows.contact)

    def _joints(self, rows: BoutRows, times: TimesOf, a: int, agent: str) -> None:
        kept = np.arange(0, len(rows), JOINTS_EVERY)
        for j, joint in enumerate(JOINTS):
            columns = rr.Scalars.columns(scalars=rows.joints[kept, a, j])
            self._drawer.send(paths.joint_path(agent, joint), times(kept), columns)


def _solid(shape: Shape, colour: tuple[int, ...]) -> Any:
    """Return the archetype of a shape, in its body's frame."""
    w, x, y, z = shape.quaternion
    place: dict[str, Any] = {
        "quaternions": [rr.Quaternion(xyzw=(x, y, z, w))],
        "colors": [colour],
        "fill_mode": "solid",
    }
    size = list(shape.size)
    if shape.kind == "box":
        return rr.Boxes3D(half_sizes=[size], centers=[shape.position], **place)
    if shape.kind == "sphere":
        return rr.Ellipsoids3D(half_sizes=[[size[0]] * 3], centers=[shape.position], **place)
    if shape.kind == "cylinder":
        return rr.Cylinders3D(
            radii=[size[0]], lengths=[2 * size[1]], centers=[shape.position], **place
        )
    # A Rerun capsule starts at its place and goes along +z; ours is centred.
    along = np.array([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)])
    start = np.asarray(shape.position) - size[1] * along
    return rr.Capsules3D(radii=[size[0]], lengths=[2 * size[1]], translations=[start], **place)
