"""A servo gives nothing within a band around its command.

So that it does not hum while it holds: hobby servos keep some tenths of a degree free. Beyond the
band the proportional part begins from its edge, within it only the derivative part is left.
"""

import functools

import numpy as np

from shared.identification.arm.places import place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.servo import (
    labels_at,
    servo_joints,
    servo_of,
    turning_servos,
)
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure

_WIDEST = 0.1
"""Half of the widest band, some six degrees (rad, m)."""
_PROBE = 5e-3
"""Some tenths of a degree (rad, m)."""
_SCALES = (1.0, 5.0)
"""Bands, in probes, less and more than a servo's own errors are."""


class _Law:
    """Values are each joint's band, stiffness and damping."""

    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        band, stiffness, damping = np.split(values, 3, axis=1)
        # What the drive gave is of the step before: since then the joint has gone on.
        proportional = step.drive + (damping - step.timestep * stiffness) * step.qd
        most = band * stiffness
        return -np.clip(proportional, -most, most)


@functools.cache
def _law() -> _Law:
    return _Law()


class DeadBand:
    """Half of a band around the command, within which the proportional part is nothing.

    Servos may all be set alike, or one be set apart.
    """

    name = "dead_band"
    title = "servos give nothing near their commands"
    signature = "Joints stop short of their commands from either side, and drift there by weight."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move and have a servo, and all of them together if all turn."""
        labels = servo_joints(subject)
        return (*turning_servos(subject), *labels) if len(labels) > 1 else labels

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return half of the band; at one joint it may be less than at the others."""
        low, unit = (-_WIDEST, place_of(subject, place).angle) if place else (0.0, "rad")
        return (Quantity("half_band", unit, low, _WIDEST, probe=_PROBE, scales=_SCALES),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: it is a torque."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Take off what the servos do not give, beside what they leave out already."""
        labels, law = row.plant.labels, _law()
        told = np.zeros((3, len(labels)))
        for each, before in row.laws:
            if each is law:
                told = before.reshape(told.shape).copy()
        for label in labels_at(row, place):
            servo, joint = servo_of(row, label), labels.index(label)
            told[:, joint] = told[0, joint] + float(values[0]), servo.stiffness, servo.damping
        row.laws = [one for one in row.laws if one[0] is not law]
        told[0] = np.maximum(told[0], 0.0)
        if told[0].any():
            row.torque(law, told.ravel())


EFFECT = DeadBand()
