"""Servos bring their set points to each command at a limited speed."""

from shared.identification.arm.places import moving
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.servo import EARLIER, turning_servos
from shared.sim.plant.profile import slewed
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure

_LEVELS = (0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0, 3.0)
"""Of the speed of the fastest joint over the limit."""


class SetpointSpeed:
    """One speed for all joints, told by its inverse: 0 is no limit."""

    name = "setpoint_speed"
    title = "servos go to each command at a limited speed"
    signature = "Joints fall behind while their commands are fast, and come after them evenly."
    side: Side = "command"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm, if positions of turning joints are told: servos are set alike."""
        return turning_servos(subject)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return one over the speed; searched on a grid, as a limit not reached changes nothing."""
        fastest = max(each.speed for each in moving(subject))
        return (
            Quantity(
                "inverse_speed", "1/(rad/s)", 0.0, 10.0 / fastest, probe=1.2 / fastest,
                is_smooth=False, grid=tuple(level / fastest for level in _LEVELS),
            ),
        )  # fmt: skip

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the command changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let set points take their time."""
        inverse = float(values[0])
        if inverse > 0.0:
            period = row.plant.timestep
            row.command = slewed(row.command, 1.0 / inverse, period, -EARLIER, row.duration)


EFFECT = SetpointSpeed()
