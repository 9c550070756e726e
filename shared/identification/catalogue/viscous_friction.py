"""A joint is braked in proportion to its speed."""

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class ViscousFriction:
    """Damping of a joint, beyond what its model file has."""

    name = "viscous_friction"
    title = "the joint's viscous friction is not what the model file says"
    signature = "A braking torque in proportion to the joint's speed, nothing while it stands."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move and have no damping; the base fit has it elsewhere."""
        known = subject.nominal.model.dof_damping
        return tuple(place.label for place in moving(subject) if known[place.dof] == 0.0)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return torque over speed: ``damping``, or ``difference`` where the file has some."""
        joint = place_of(subject, place)
        full = joint.drive / joint.speed
        unit = f"{joint.torque} s/{joint.angle}"
        known = float(subject.nominal.model.dof_damping[joint.dof])
        name = "difference" if known else "damping"
        return (Quantity(name, unit, -known, 4.0 * full, probe=0.1 * full),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may be damped."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Damp the joint."""
        row.field("dof_damping")[row.dof(place)] += float(values[0])


EFFECT = ViscousFriction()
