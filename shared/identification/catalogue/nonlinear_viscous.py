"""A joint's viscous friction is not in proportion to its speed."""

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class NonlinearViscous:
    """MuJoCo's damping ``a v + b v |v|``: b > 0 is drag, b < 0 a grease that thins with speed."""

    name = "nonlinear_viscous"
    title = "the joint's viscous friction grows faster or slower than its speed"
    signature = "A braking torque that is odd in the speed but not in proportion to it."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return ``b``; at its least the nominal damping is used up at the joint's top speed."""
        joint = place_of(subject, place)
        full = joint.drive / joint.speed**2
        damping = float(subject.nominal.model.dof_damping[joint.dof])
        lowest = damping / joint.speed if damping else full
        unit = f"{joint.torque} s^2/{joint.angle}^2"
        return (Quantity("quadratic", unit, -lowest, 4.0 * full, probe=0.1 * full),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may be damped."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Bend the damping."""
        row.field("dof_dampingpoly")[row.dof(place), 0] += float(values[0])


EFFECT = NonlinearViscous()
