"""A joint is pulled towards an angle, as by a cable that runs along it."""

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.passive import add_spring
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class JointSpring:
    """A torque that follows the joint's position."""

    name = "joint_spring"
    title = "something like a cable pulls the joint towards an angle"
    signature = "A torque that depends on the joint's position alone, not on speed or load."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the stiffness and the angle of rest, not far outside of where the joint was."""
        joint = place_of(subject, place)
        full = joint.drive / joint.travel
        highest = joint.lowest + joint.travel
        return (
            Quantity("stiffness", f"{joint.torque}/{joint.angle}", 0.0, 4.0 * full, 0.2 * full),
            Quantity(
                "rest",
                joint.angle,
                joint.lowest - joint.travel,
                highest + joint.travel,
                probe=0.5 * joint.travel,
                grid=(joint.lowest, 0.5 * (joint.lowest + highest), highest),
                ends=(True, True),  # so far off it is a constant torque rather
            ),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may have a spring."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Add the spring to what the joint has."""
        stiffness, rest = float(values[0]), float(values[1])
        add_spring(row, place, stiffness, stiffness * rest)


EFFECT = JointSpring()
