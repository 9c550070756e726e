"""A joint is braked harder one way than the other.

Viscous friction ``(F + d sign(v)) v`` is the usual one plus ``d |v|``. Coulomb levels that differ
by direction are no effect of their own: they are equal levels and a ``torque_bias``, standing still
included. EMPS (Janot 2019) has both forms.
"""

import numpy as np

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.passive import at_joint
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure


class _Law:
    """A torque against the positive direction, whichever way the joint moves."""

    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        return -values * np.abs(step.qd)


_LAW = _Law()


class AsymmetricFriction:
    """Half the difference between viscous friction forwards and backwards."""

    name = "asymmetric_friction"
    title = "the joint is braked harder one way than the other"
    signature = "The residual grows with speed and has the same sign both ways."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return half the difference; positive brakes the positive direction more."""
        joint = place_of(subject, place)
        full = joint.drive / joint.speed
        unit = f"{joint.torque} s/{joint.angle}"
        return (Quantity("half_difference", unit, -2.0 * full, 2.0 * full, probe=0.1 * full),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: it is a torque."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the torque act."""
        if values[0]:
            row.torque(_LAW, at_joint(row, place, float(values[0])))


EFFECT = AsymmetricFriction()
