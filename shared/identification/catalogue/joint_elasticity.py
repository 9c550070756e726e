"""A joint's belt or gear gives between motor and link."""

from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.subject import Subject
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Builder, Edit, Structure, series_name


class JointElasticity:
    """A torsion spring after the encoder."""

    name = "joint_elasticity"
    title = "the joint's transmission gives like a spring"
    signature = "The encoder looks right while the tool deflects with load, and rings."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        moves = subject.travel > 0.05
        return tuple(name for name, is_moved in zip(subject.joints, moves, strict=True) if is_moved)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return how far it gives; the inverse of a stiffness, so that 0 is rigid."""
        return (Quantity("compliance", "rad/(N m)", 0.0, 0.1, probe=0.002),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return the second joint."""

        def change(builder: Builder) -> None:
            builder.series_joint(place)

        return (Edit(f"series {place}", change),)

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Set the spring; its damping is small: a tenth of critical at 0.01 kg m^2."""
        row.spring(series_name(row.plant, place), float(values[0]), ringing=0.02)


EFFECT = JointElasticity()
