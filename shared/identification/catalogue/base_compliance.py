"""What the arm stands on gives."""

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.sway import start_swaying
from shared.identification.laws.vertical import horizontal_axes
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Builder, Edit, Structure

_RINGING = 0.1
"""A twentieth of critical with 1 kg m^2 of arm (sqrt(kg) m)."""
_SWING = 0.1
"""What the arm's speeds are taken from, for how it sways when a part begins (s)."""

_SOFT = (0.3, 1.0, 3.0, 8.0)
"""Times the probe: what is softer also sways more slowly."""


class BaseCompliance:
    """Torsion springs under the base, about its two horizontal axes."""

    name = "base_compliance"
    title = "what the arm stands on gives"
    signature = "The tool sways with the arm's acceleration while every encoder looks right."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm, if a tracker watches it: encoders do not see the base."""
        return ("",) if subject.has_tracker else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return how far it turns under a torque about each axis, 0 is rigid, and its damping.

        That is ``ringing`` times the square root of the stiffness (N m s/rad).
        """
        turning = (
            Quantity(f"about_{axis}", "rad/(N m)", 0.0, 0.02, probe=3e-4, scales=_SOFT)
            for axis in horizontal_axes(subject.nominal.model.opt.gravity)
        )
        ringing = Quantity("ringing", "sqrt(kg) m", 0.0, 2.0, probe=_RINGING, grid=(_RINGING,))
        return (*turning, ringing)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return the two joints."""
        model = subject.nominal.model
        body = model.body(subject.plant.base_body)
        turned = _rotation(np.array(body.quat))
        axes = horizontal_axes(subject.nominal.model.opt.gravity)

        def change(builder: Builder) -> None:
            for axis in axes:
                row = turned["xyz".index(axis)]  # a world axis in the body's frame
                builder.base_joint((float(row[0]), float(row[1]), float(row[2])), _joint(axis))

        return (Edit("base", change),)

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Set the springs, swung by what the arm did before."""
        axes = horizontal_axes(row.model.opt.gravity)
        *compliances, ringing = (float(value) for value in values)
        for axis, compliance in zip(axes, compliances, strict=True):
            row.spring(_joint(axis), compliance, ringing)
        if any(compliances):
            start_swaying(row, [_joint(axis) for axis in axes], _SWING)


def _joint(axis: str) -> str:
    return f"base/about_{axis}"


def _rotation(quaternion: Float64) -> Float64:
    """Return float64[3, 3] of a unit quaternion w x y z: from the body's frame to the world's."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


EFFECT = BaseCompliance()
