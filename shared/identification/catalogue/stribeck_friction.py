"""A joint's friction is higher when it starts to move than when it moves.

``F(v) = excess * exp(-(v / falloff)^2)`` on top of the constant level that the base fit or
``coulomb_friction`` has (Armstrong-Helouvry 1994, with exponent 2). That is a level set anew before
each step, of MuJoCo's own friction constraint or of bristles (``sim/plant/bristles.py``), so that
the joint really sticks and no step is too long for it; MuJoCo's LuGre element (``dcmotor``) costs
an activation and a compiled model per joint.
"""

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
    """Values are each joint's excess, then each joint's falloff."""

    def __call__(self, step: Step, values: Float64) -> Float64:
        excess, falloff = np.split(values, 2, axis=1)
        times = np.minimum(np.abs(step.qd) / np.maximum(falloff, 1e-6), _FAST)
        return excess * np.exp(-np.square(times))


_LAW = _Law()
_FAST = 10.0
"""Falloffs at which nothing is left of it, however fast a joint flies off."""
_SLOWLY = 0.3
"""Of the joint's fastest: what falls off over more than that is dry friction rather."""


class StribeckFriction:
    """Static friction above the dynamic one; it turns round over its bend."""

    name = "stribeck_friction"
    title = "the joint sticks harder than it slides"
    signature = "The joint hangs and then jumps near standstill and at reversals, not when fast."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return how much more it sticks than it slides, up to about which speed, and its bend."""
        joint = place_of(subject, place)
        return (
            Quantity("excess", joint.torque, 0.0, 2.0 * joint.drive, probe=0.1 * joint.drive),
            Quantity(
                "falloff", f"{joint.angle}/s", 0.01 * joint.speed, _SLOWLY * joint.speed,
                probe=0.1 * joint.speed,
                grid=(0.03 * joint.speed, 0.1 * joint.speed, 0.2 * joint.speed),
                ends=(False, True),
            ),
            bend_of(joint),
        )  # fmt: skip

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may rub."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the joint stick."""
        if values[0]:
            law = at_joint(row, place, float(values[0]), float(values[1]))
            row.friction(_LAW, law, at_joint(row, place, float(values[2])))


EFFECT = StribeckFriction()
