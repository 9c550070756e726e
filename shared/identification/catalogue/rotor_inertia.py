"""A joint is harder to speed up than its links say: its drive's rotor, times the ratio squared."""

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class RotorInertia:
    """Armature of a joint, beyond what its model file has."""

    name = "rotor_inertia"
    title = "the inertia of the joint's drive is not what the model file says"
    signature = "A torque in proportion to the joint's acceleration, in any posture."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move and have no armature; the base fit has it elsewhere."""
        known = subject.nominal.model.dof_armature
        return tuple(place.label for place in moving(subject) if known[place.dof] == 0.0)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return torque over acceleration: ``inertia``, or ``difference`` where the file has some.

        At most it is what all of the drive could just speed up.
        """
        joint = place_of(subject, place)
        full = joint.drive / joint.acceleration
        unit = "kg" if joint.is_sliding else "kg m^2"
        known = float(subject.nominal.model.dof_armature[joint.dof])
        name = "difference" if known else "inertia"
        return (Quantity(name, unit, -known, full, probe=0.1 * full),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may have a rotor."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the rotor turn with the joint."""
        row.field("dof_armature")[row.dof(place)] += float(values[0])


EFFECT = RotorInertia()
