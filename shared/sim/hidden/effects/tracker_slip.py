"""The tracker slips on the tool while it is recorded, and stays there."""

import numpy as np

from shared.sim.arm import Float64
from shared.sim.hidden.effect import Case, Hidden, Scene, direction
from shared.sim.hidden.robot import Robot

_SOFT = 0.03
"""The slip takes so long (s)."""


def _places(scene: Scene) -> tuple[str, ...]:
    return scene.train


def _instant(case: Case) -> float:
    return (0.2 + 0.6 * float(case.shape[2])) * case.scene.duration


def _enter(robot: Robot, case: Case) -> None:
    order = case.scene.trajectories
    way = case.size * direction(case.shape)

    def slip(name: str, at: Float64, poses: Float64) -> Float64:
        if name not in order or order.index(name) < order.index(case.place):
            return poses
        share = np.ones(len(at))
        if name == case.place:
            share = np.clip((at - _instant(case)) / _SOFT, 0.0, 1.0)
        out = poses.copy()
        out[:, :3] += _turned(poses[:, 3:], share[:, None] * way)
        return out

    robot.trackers.append(slip)


def _turned(quaternions: Float64, vectors: Float64) -> Float64:
    """Return float64[K, 3], vectors of the hand's frame in that of the poses."""
    scalar, vector = quaternions[:, :1], quaternions[:, 1:]
    twice = 2.0 * np.cross(vector, vectors)
    return vectors + scalar * twice + np.cross(vector, twice)


HIDDEN = Hidden(
    name="tracker_slip",
    way="it takes a moment",
    places=_places,
    sizes=lambda scene, place: (5e-4, 0.03),
    values=lambda case: {
        **{
            axis: (float(part), "m")
            for axis, part in zip("xyz", case.size * direction(case.shape), strict=True)
        },
        "time": (_instant(case) + 0.5 * _SOFT, "s"),
    },
    enter=_enter,
)
