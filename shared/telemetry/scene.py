"""What a viewer needs to know of the scene to draw it; the simulator's model fits as it is."""

import dataclasses
from collections.abc import Sequence
from typing import Literal, Protocol

from shared.messages.message import Array
from shared.messages.training import AGENTS

Kind = Literal["box", "capsule", "sphere", "cylinder"]

JOINTS = (
    "shoulder_pan",
    "shoulder_lift",
    "upper_arm_roll",
    "elbow_flex",
    "forearm_roll",
    "wrist_flex",
    "wrist_roll",
)
"""Joints of one arm, in the order of ``BoutFrames.joints``."""


class Fixed(Protocol):
    """What is fixed to a body and can be looked at."""

    @property
    def body(self) -> int:
        """Index of the body."""
        ...

    @property
    def size(self) -> Sequence[float]:
        """Half extents (box, ellipsoid); radius, half length (capsule, cylinder); radius (m)."""
        ...

    @property
    def position(self) -> Sequence[float]:
        """Centre in the body's frame (m)."""
        ...

    @property
    def quaternion(self) -> Sequence[float]:
        """Orientation in the body's frame, w x y z."""
        ...

    @property
    def rgba(self) -> Sequence[float]:
        """Red, green, blue, opacity, each in 0..1."""
        ...


class Shape(Fixed, Protocol):
    """A primitive of the scene."""

    @property
    def kind(self) -> Kind:
        """What it is; long ones lie along their own z."""
        ...

    @property
    def name(self) -> str:
        """Unique in the scene."""
        ...


@dataclasses.dataclass(frozen=True)
class Scene:
    """Two robots, two bats and the target between them."""

    body_names: tuple[str, ...]
    """``<agent>/<part>``, in the order of ``BoutFrames.positions``."""
    shapes: Sequence[Shape]
    target_centre: Array
    """float64[3] (m)."""
    target_radius: float
    """(m)."""
    control_timestep: float = 0.01
    """Seconds from one control step to the next."""
    agents: tuple[str, str] = AGENTS
