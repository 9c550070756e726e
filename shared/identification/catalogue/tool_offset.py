"""The tracker sits elsewhere on the tool than the model has it."""

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.frames import frame_quantities, move_hand
from shared.sim.plant.poses import frame
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class ToolOffset:
    """A rigid motion between where the tracker is and where it should be."""

    name = "tool_offset"
    title = "the tracker sits elsewhere on the tool"
    signature = "Only the tracker is off, by a motion that is constant in the hand's frame."
    side: Side = "tracker"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm if a tracker saw it."""
        return ("",) if subject.has_tracker else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the tracker's pose in the frame that it should have."""
        return frame_quantities()

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the log changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Move the tracker on the tool."""
        move_hand(row, frame(values))


EFFECT = ToolOffset()
