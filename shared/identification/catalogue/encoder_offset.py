"""A joint's encoder has another zero than the model."""

from shared.identification.arm.places import place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.encoders import misread
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class EncoderOffset:
    """The log and the controller see the joint this much further than it is.

    On a PR2 the flag that a joint is calibrated against is off (``cal_*_flag`` of its URDF).
    """

    name = "encoder_offset"
    title = "the joint's encoder has a wrong zero"
    signature = "A constant angle between encoder and tracker, so an error that posture turns."
    side: Side = "joints"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints; none if neither a tracker nor gravity knows the posture."""
        return subject.joints if subject.has_tracker or subject.has_gravity else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return what the encoder says too much."""
        joint = place_of(subject, place)
        if joint.is_sliding:
            return (Quantity("offset", joint.angle, -0.1, 0.1, probe=0.003),)
        return (Quantity("offset", joint.angle, -0.3, 0.3, probe=0.01),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let log and controller see another angle."""
        if values[0] != 0.0:
            misread(row, place, scale=1.0, offset=float(values[0]))


EFFECT = EncoderOffset()
