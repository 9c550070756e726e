"""A gear's friction grows with the load on it."""

import numpy as np

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.bend import bend_of
from shared.identification.laws.passive import at_joint
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure


class _Law:
    """Friction in proportion to what the gear transmits."""

    def __call__(self, step: Step, values: Float64) -> Float64:
        return values * np.abs(step.load)


_LAW = _Law()


class LoadFriction:
    """Coulomb friction in proportion to the torque that a gear transmits.

    BAM's model M3 takes the difference of motor and external torque: twice this, where rotor and
    arm have the same inertia (Duclusaud et al., ICRA 2025). It turns round over its bend.
    """

    name = "load_friction"
    title = "friction grows with the load on the joint"
    signature = "A step at each reversal whose height follows the torque on the joint."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the share of the torque that is lost, and its bend."""
        return (Quantity("share", "1", 0.0, 0.8, probe=0.1), bend_of(place_of(subject, place)))

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may rub."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the joint rub."""
        if values[0]:
            ways = at_joint(row, place, float(values[1]))
            row.friction(_LAW, at_joint(row, place, float(values[0])), ways)


EFFECT = LoadFriction()
