"""What a robot says of itself, for those who record a bout and for those who identify the arm."""

from typing import Annotated

import msgspec
import numpy as np

from shared.messages.message import Array, ArraySpec, Message


class RobotReport(Message, frozen=True, kw_only=True):
    """The robot's state as the loop read it at one tick, beside its bat, tool and joints."""

    tick: int
    """Of the bat states and arm states published with it."""
    boot: str
    at_ns: int
    """Wall clock at which this state arrived; the tick's own is when it was read."""
    speed: float
    """Of the tool (m/s)."""
    force: float | None
    """On the tool (N); None where the robot does not tell."""
    effort_share: float | None
    """Largest share of its limit that a joint gives; None where the robot does not tell."""
    is_run_stopped: bool
    are_motors_halted: bool
    generation: int
    """Of the controller: it changes when that is restarted."""
    problems: tuple[str, ...] = ()
    """What keeps the robot from being moved."""
    efforts: Annotated[Array, ArraySpec("float64", ("E",))] = msgspec.field(
        default_factory=lambda: np.zeros(0)
    )
    """Of the joints, shoulder to wrist (N m); none where the robot does not tell."""
