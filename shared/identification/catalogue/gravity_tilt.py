"""The arm's base is not level, or gravity has another direction than the model says."""

import math

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.vertical import horizontal_axes
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure


class GravityTilt:
    """Gravity turned about the two horizontal axes."""

    name = "gravity_tilt"
    title = "the base stands at a tilt"
    signature = "Every joint that carries weight is off by a load of one direction, at rest too."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm, if it has weight."""
        return ("",) if subject.has_gravity else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the two angles, about the horizontal axes of the model's world."""
        first, second = (
            f"about_{axis}" for axis in horizontal_axes(subject.nominal.model.opt.gravity)
        )
        return (
            Quantity(first, "rad", -0.3, 0.3, probe=0.03),
            Quantity(second, "rad", -0.3, 0.3, probe=0.03),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: gravity is there."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Turn gravity: as a vector of angles, the whole turn at once.

        A controller that carries the weight of links goes on as if the base were level.
        """
        gravity = row.field("opt.gravity")
        level = gravity.copy()
        turn = np.zeros(3)
        for axis, angle in zip(horizontal_axes(gravity), values, strict=True):
            turn["xyz".index(axis)] = angle
        size = float(np.linalg.norm(turn))
        if size == 0.0:
            return
        axis = turn / size
        gravity[:] = (  # Rodrigues
            math.cos(size) * gravity
            + math.sin(size) * np.cross(axis, gravity)
            + (1.0 - math.cos(size)) * (axis @ gravity) * axis
        )
        carried = row.current("body_gravcomp") * row.current("body_mass")
        for body in np.flatnonzero(carried):
            x, y, z = carried[body] * (gravity - level)
            row.forces[int(body)] = (float(x), float(y), float(z))


EFFECT = GravityTilt()
