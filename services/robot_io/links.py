"""What stands on the robot's side of the gate: a twin now, a PR2 behind the same protocol."""

from typing import Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class RobotState(msgspec.Struct, frozen=True, kw_only=True):
    """What a robot says of itself."""

    at: float
    """When it arrived, by our monotonic clock (s)."""
    tool: Floats
    """float64[7]: position (m), orientation (w x y z) in the torso frame."""
    speed: float
    """Of the tool (m/s)."""
    bat: Floats
    """float64[13], world frame: pose, linear (m/s) and angular velocity (rad/s)."""
    joints: Floats
    """float64[7], shoulder to wrist (rad)."""
    joint_velocities: Floats
    """float64[7] (rad/s)."""
    joint_efforts: Floats | None = None
    """float64[7] (N m); None where the robot does not tell."""
    force: float | None = None
    """On the tool (N)."""
    effort_share: float | None = None
    """Largest share of its limit that a joint gives."""
    is_run_stopped: bool = False
    are_motors_halted: bool = False
    generation: int = 0
    """Changes when the controller is restarted."""
    problems: tuple[str, ...] = ()
    """What else keeps the robot from being moved."""
    passed: tuple[str, ...] = ()
    """What was looked at and is in order, for the list that a person sees before arming."""


class RobotLink(Protocol):
    """A robot; one thread, and nothing here may block longer than a millisecond."""

    def read(self, now: float) -> RobotState:
        """Return the newest state there is."""
        ...

    def write(self, pose: Floats) -> None:
        """Send a command that the gate let through: float64[7], as ``RobotState.tool``."""
        ...

    def hold(self) -> None:
        """Make the controller stay where the robot is, forgetting its target."""
        ...

    def rates(self) -> dict[str, float]:
        """Return what it measures of itself, by name with unit."""
        ...

    def counters(self) -> dict[str, int]:
        """Return what it has counted since the start."""
        ...

    def close(self) -> None:
        """Let go of the robot, which stays where it is."""
        ...


class OtherRobot(Protocol):
    """A robot that stands in for the person; only a simulated one can."""

    def read_other(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Return its bat float64[13], tool [7], joints [7] and joint velocities [7]."""
        ...

    def write_other(self, pose: Floats) -> None:
        """Command its tool: float64[7]."""
        ...


class PersonBat(Protocol):
    """A simulated scene that a person's tracked bat is put into."""

    def place_person(self, bat: Floats) -> None:
        """Put the bat there: float64[13]."""
        ...
