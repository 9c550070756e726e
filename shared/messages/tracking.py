"""What a tracker says before anything is made of it."""

from typing import Annotated

from shared.messages.message import Array, ArraySpec, Message


class TrackerRaw(Message, frozen=True, kw_only=True):
    """A Vive tracker where its base stations see it; what a calibration is made of."""

    at_ns: int
    """Wall clock when it was said."""
    serial: str
    pose: Annotated[Array, ArraySpec("float64", (7,))]
    """Tracker in the base stations' frame: position (m), orientation (w x y z)."""
    is_valid: bool
    """False while it is lost; the pose is then the last there was."""
