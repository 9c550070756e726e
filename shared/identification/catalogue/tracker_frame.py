"""The tracker's world is not where its calibration says it is."""

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.frames import frame_quantities, move_world
from shared.sim.plant.poses import frame
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class TrackerFrame:
    """A rigid motion between the base frame and what the tracker's poses are given in."""

    name = "tracker_frame"
    title = "the tracker's frame is not the robot's base frame"
    signature = "Only the tracker is off, by a motion that is constant in the world."
    side: Side = "tracker"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm if a tracker saw it."""
        return ("",) if subject.has_tracker else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the pose of the tracker's base frame in the true one."""
        return frame_quantities()

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the log changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Give poses in the other frame."""
        move_world(row, frame(values))


EFFECT = TrackerFrame()
