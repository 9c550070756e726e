"""Poses are commanded in another frame than the model's base frame."""

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.frames import frame_quantities
from shared.sim.plant.poses import frame, seen_from
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal
from shared.sim.plant.structure import Structure


class CommandFrame:
    """A rigid motion between the model's base frame and the one that commands are meant in."""

    name = "command_frame"
    title = "commands are understood in another frame than the model's base frame"
    signature = "The tool settles beside its command by a motion that is constant in the world."
    side: Side = "command"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm if commands are poses."""
        return ("",) if subject.control == "pose" else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the pose of the commands' frame in the model's."""
        return frame_quantities()

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the command changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Command the poses where the robot takes them to be."""
        row.command = Signal(row.command.at, seen_from(frame(values), row.command.values))


EFFECT = CommandFrame()
