"""Numbers of the robot's messages, checked before anything uses them."""

import math
from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np

from services.robot_io.links import Floats
from services.robot_io.poses import Pose, Vector, add, product, rotated, unit
from shared.errors import MessageError
from shared.ros.types import seconds_of

NO_POSE = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Of a tool that has not been heard of."""


class CartState(msgspec.Struct, frozen=True, kw_only=True):
    """What the Cartesian controller says of itself."""

    at: float
    """When it arrived, by our monotonic clock (s)."""
    stamp: float
    """When it was made, by the robot's clock (s)."""
    tool: Pose
    """In the torso frame."""
    velocity: Vector
    """Of the tool (m/s), same frame."""
    spin: Vector
    """rad/s."""
    target: Vector
    """``x_desi`` (m); may be NaN."""
    filtered: Vector
    """``x_desi_filtered`` (m), which the spring pulls to; may be NaN."""
    is_target_finite: bool
    """Whether that is made of numbers, its orientation too."""
    force: float
    """That the controller puts on the tool (N); may be NaN."""


class JointsState(msgspec.Struct, frozen=True, kw_only=True):
    """The arm's joints, shoulder to wrist."""

    at: float
    positions: Floats
    velocities: Floats
    efforts: Floats
    """float64[7] each: rad, rad/s, N m."""


def cart_state(message: Any, at: float, frame: str) -> CartState:
    """Return a ``JTCartesianControllerState`` as numbers.

    Raises:
        MessageError: its pose or speed is not a number, or is in another frame.
    """
    said = str(message.x.header.frame_id).lstrip("/")
    if said and said != frame:
        raise MessageError(f"the controller's pose is in {said[:60]}, expected {frame}")
    tool = _pose(message.x.pose)
    velocity, spin = _vector(message.xd.linear), _vector(message.xd.angular)
    size = math.hypot(*tool.orientation)
    if not all(map(math.isfinite, (*tool.position, size, *velocity, *spin))) or size < 0.5:
        raise MessageError("the controller's pose or speed is not a number")
    filtered = _pose(message.x_desi_filtered.pose)
    return CartState(
        at=at,
        stamp=seconds_of(message.header.stamp),
        tool=Pose(tool.position, unit(tool.orientation)),
        velocity=velocity,
        spin=spin,
        target=_vector(message.x_desi.pose.position),
        filtered=filtered.position,
        is_target_finite=all(map(math.isfinite, (*filtered.position, *filtered.orientation))),
        force=math.hypot(*_vector(message.F.force)),
    )


class JointReader:
    """Finds the arm among the robot's joints."""

    def __init__(self, joints: Sequence[str]) -> None:
        """Take the names, shoulder to wrist."""
        self._joints = tuple(joints)
        self._names: list[str] = []
        self._places: list[int] = []

    def read(self, message: Any, at: float) -> JointsState:
        """Return a ``JointState`` as numbers.

        Raises:
            MessageError: a joint is missing, or a value is not a number.
        """
        if message.name != self._names:
            places = {name: index for index, name in enumerate(message.name)}
            if missing := [joint for joint in self._joints if joint not in places]:
                raise MessageError(f"/joint_states has no {missing[0]}")
            self._names = list(message.name)
            self._places = [places[joint] for joint in self._joints]
        columns = (message.position, message.velocity, message.effort)
        if any(len(column) != len(self._names) for column in columns):
            raise MessageError("/joint_states lacks positions, velocities or efforts")
        found = np.array([column[self._places] for column in columns], np.float64)
        if not np.isfinite(found).all():
            raise MessageError("/joint_states has a number that is not finite")
        return JointsState(at=at, positions=found[0], velocities=found[1], efforts=found[2])


class BatFrame(msgspec.Struct, frozen=True):
    """How the bat's frame lies in the world, given the tool's in the torso frame."""

    world_from_torso: Pose
    bat_in_tool: tuple[float, float, float, float]
    """Its orientation; their origins are the same."""

    def state(self, cart: CartState) -> Floats:
        """Return float64[13]: pose, linear (m/s) and angular velocity (rad/s) in the world."""
        outer = self.world_from_torso
        position = add(outer.position, rotated(outer.orientation, cart.tool.position))
        orientation = product(outer.orientation, product(cart.tool.orientation, self.bat_in_tool))
        velocity = rotated(outer.orientation, cart.velocity)
        spin = rotated(outer.orientation, cart.spin)
        return np.array([*position, *unit(orientation), *velocity, *spin])


def _vector(found: Any) -> Vector:
    return float(found.x), float(found.y), float(found.z)


def _pose(found: Any) -> Pose:
    turn = found.orientation
    return Pose(
        _vector(found.position), (float(turn.w), float(turn.x), float(turn.y), float(turn.z))
    )
