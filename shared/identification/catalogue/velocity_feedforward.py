"""Controllers are told how fast to go, too: joints are damped towards the command's speed.

Where a servo's damping brakes every motion, such a controller brakes what is too fast for its
command; it follows with next to no lag. What it adds is the command's speed times the damping.
"""

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.servo import (
    labels_at,
    servo_joints,
    servo_of,
    together_or_apart,
)
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal
from shared.sim.plant.structure import Structure

_FEWEST = 3
"""Commands that have a speed."""
_SMALLEST = 0.05
"""A share that is no controller's: a simulation is early or late by as much (half of its step)."""


class VelocityFeedforward:
    """The command's speed, times a share of what damps the joint and its servo.

    Controllers may all do so alike, or one be set apart.
    """

    name = "velocity_feedforward"
    title = "the controller feeds the speed of its command forward"
    signature = "Joints lag less, or lead, the more so the faster the command moves."
    side: Side = "command"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move and have a servo, and all of them together."""
        return together_or_apart(servo_joints(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the share; at one joint it may be less than at the others."""
        low = -2.0 if place else 0.0
        return (Quantity("share", "1", low, 2.0, probe=0.2, scales=(1.0, 5.0), least=_SMALLEST),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the command changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let commands lead by what their speed is worth."""
        share, command = float(values[0]), row.command
        if not share or len(command.at) < _FEWEST:
            return
        lead = np.zeros(command.values.shape[1])
        for label in labels_at(row, place):
            servo = servo_of(row, label)
            damping = servo.damping + float(row.current("dof_damping")[row.dof(label)])
            lead += np.where(servo.gain, share * damping / servo.gain.sum(), 0.0)
        speed = np.gradient(command.values, command.at, axis=0)
        row.command = Signal(command.at, command.values + lead * speed)


EFFECT = VelocityFeedforward()
