"""A joint rubs by the same torque however fast it moves, and sticks when it stands."""

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.passive import add_friction
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class CoulombFriction:
    """Dry friction of a joint, beyond what its model file has."""

    name = "coulomb_friction"
    title = "the joint's dry friction is not what the model file says"
    signature = "A step at each reversal, the same at any speed; the joint sticks when it stands."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move and have no friction; the base fit has it elsewhere.

        A PR2's are fitted in any case.
        """
        if subject.control == "pose":
            return ()
        known = subject.nominal.model.dof_frictionloss
        return tuple(place.label for place in moving(subject) if known[place.dof] == 0.0)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the torque: ``level``, or ``difference`` where the file has some."""
        joint = place_of(subject, place)
        known = float(subject.nominal.model.dof_frictionloss[joint.dof])
        name = "difference" if known else "level"
        return (Quantity(name, joint.torque, -known, 2.0 * joint.drive, probe=0.1 * joint.drive),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may rub."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the joint rub."""
        add_friction(row, place, float(values[0]))


EFFECT = CoulombFriction()
