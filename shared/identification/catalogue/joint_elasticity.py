"""A joint's belt or gear gives between motor and link."""

import math

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.series import link_inertia, series
from shared.identification.laws.sway import start_stretched, start_swaying
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure, series_name

_PART = "series"
_DAMPING = 0.03
"""Of critical: what steel and bolted joints lose."""
_SWING = 0.06
"""What the arm's speeds are taken from, for how the link swings when a part begins (s)."""


class JointElasticity:
    """A torsion spring between motor and link."""

    name = "joint_elasticity"
    title = "the joint's transmission gives like a spring"
    signature = "The encoder looks right while the tool deflects with load, and rings."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return how far it gives; the inverse of a stiffness, so that 0 is rigid."""
        joint = place_of(subject, place)
        far = (0.02 if joint.is_sliding else 0.2) / joint.drive
        unit = f"{joint.angle}/({joint.torque})"
        return (Quantity("compliance", unit, 0.0, 2.0 * far, probe=0.05 * far),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return the second joint."""
        return series(subject, place, _PART)

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Set the spring, swung by what the joint did before."""
        compliance = float(values[0])
        name = series_name(row.plant, place, _PART)
        inertia = link_inertia(row, row.mj_joint(name))
        row.spring(name, compliance, ringing=2.0 * _DAMPING * math.sqrt(inertia))
        if compliance:
            row.trust_encoders()
            if row.plant.encoders == "link":
                start_stretched(row, name)
            else:
                start_swaying(row, [name], _SWING)


EFFECT = JointElasticity()
