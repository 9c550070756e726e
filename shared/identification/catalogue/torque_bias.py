"""A joint's drive pushes by a constant torque that nobody asked for."""

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.passive import add_spring
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class TorqueBias:
    """An offset of the drive (EMPS: -3.1 N), or Coulomb friction that differs by direction.

    In one posture a counterbalance or a payload does the same: only other postures tell.
    """

    name = "torque_bias"
    title = "the joint's drive has a constant torque offset"
    signature = "The joint is off the same way at rest and in motion, in every posture."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the torque; a positive one pushes towards positive angles."""
        joint = place_of(subject, place)
        most = 2.0 * joint.drive
        return (Quantity("torque", joint.torque, -most, most, probe=0.1 * joint.drive),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may have a spring."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Push the joint."""
        add_spring(row, place, stiffness=0.0, torque=float(values[0]))


EFFECT = TorqueBias()
