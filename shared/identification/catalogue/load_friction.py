"""A gear's friction grows with the load on it."""

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.subject import Subject
from shared.sim.plant.row import Row, Step
from shared.sim.plant.structure import Structure

_SLOW = 0.02
"""Friction is in full from about here on (rad/s, m/s)."""


class _Law:
    """Friction in proportion to the drive's torque, of one joint."""

    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        return -values * np.abs(step.drive) * np.tanh(step.qd / _SLOW)


_LAW = _Law()


class LoadFriction:
    """Coulomb friction in proportion to the torque that a gear transmits (BAM, model M3)."""

    name = "load_friction"
    title = "friction grows with the load on the joint"
    signature = "A step at each reversal whose height follows the torque on the joint."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        moves = subject.travel > 0.05
        return tuple(name for name, is_moved in zip(subject.joints, moves, strict=True) if is_moved)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the share of the torque that is lost."""
        return (Quantity("share", "1", 0.0, 0.8, probe=0.1),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: it is a torque."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let friction act on the joint."""
        shares = np.zeros(len(row.plant.labels))
        shares[row.plant.labels.index(place)] = float(values[0])
        row.torque(_LAW, shares)


EFFECT = LoadFriction()
