"""Servos ramp their set points: with limited acceleration, from where they are to each command."""

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.servo import EARLIER, turning_servos
from shared.sim.plant.profile import ramped
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure

_LEAST = 1e-6
"""One over an acceleration that is no limit (s^2/rad)."""


_SCALES = (0.1, 0.5, 2.0)
"""Accelerations of 500, 100 and 25 rad/s^2, in probes: over what a drive can do, and under it."""


class SetpointRamp:
    """One acceleration for all joints, told by its inverse: 0 is no limit."""

    name = "setpoint_ramp"
    title = "servos ramp to each command with limited acceleration"
    signature = "Joints lag by a time that grows with their speed, and take their time over steps."
    side: Side = "command"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm, if positions of turning joints are told: servos are set alike."""
        return turning_servos(subject)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return one over the acceleration."""
        return (
            Quantity("inverse_acceleration", "1/(rad/s^2)", 0.0, 1.0, probe=0.02, scales=_SCALES),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the command changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let set points ramp."""
        inverse = float(values[0])
        if inverse > _LEAST:
            acceleration, period = 1.0 / inverse, row.plant.timestep
            row.command = ramped(row.command, acceleration, period, -EARLIER, row.duration)


EFFECT = SetpointRamp()
