"""A joint's encoder counts another angle per turn than the model."""

from shared.identification.arm.places import moving
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.encoders import misread
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class EncoderScale:
    """The log and the controller see (1 + s) of the joint's angle: a wrong gear ratio or pulley.

    On a PR2 it is ``cal_*_gearing`` of its URDF. That the gear also changes the torque is
    ``torque_gain``: drives are often calibrated by themselves.
    """

    name = "encoder_scale"
    title = "the joint's encoder counts in another gear ratio"
    signature = "An angle between encoder and tracker in proportion to the joint's angle."
    side: Side = "joints"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return by what share the encoder says too much."""
        return (Quantity("share", "1", -0.2, 0.2, probe=0.02),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let log and controller see another angle."""
        if values[0] != 0.0:
            misread(row, place, scale=1.0 + float(values[0]), offset=0.0)


EFFECT = EncoderScale()
