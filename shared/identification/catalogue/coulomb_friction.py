"""A joint rubs by the same torque however fast it moves, and sticks when it stands."""

import numpy as np

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.bend import bend_of
from shared.identification.laws.passive import add_friction, at_joint
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure


class _Law:
    """Values are each joint's level."""

    def __call__(self, step: Step, values: Float64) -> Float64:
        return values


_LAW = _Law()


class CoulombFriction:
    """Dry friction of a joint, beyond what its model file has; it turns round over its bend."""

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
        """Return the torque (``level``, or ``difference`` from the file's), and its bend."""
        joint = place_of(subject, place)
        known = float(subject.nominal.model.dof_frictionloss[joint.dof])
        most, probe = 2.0 * joint.drive, 0.1 * joint.drive
        if known:  # that turns round at once, and so does what is added to it or taken off
            return (Quantity("difference", joint.torque, -known, most, probe),)
        return Quantity("level", joint.torque, 0.0, most, probe), bend_of(joint)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may rub."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the joint rub."""
        level = float(values[0])
        add_friction(row, place, level)
        if level and values[1:].any():  # what bends is in the place of what the model has now
            soft, ways = at_joint(row, place, level), at_joint(row, place, float(values[1]))
            row.friction(_LAW, -soft, np.zeros_like(ways))
            row.friction(_LAW, soft, ways)


EFFECT = CoulombFriction()
