"""A joint's drive gives no more than a torque below what the model allows."""

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure

_LEVELS = (0.5, 0.65, 0.8, 0.95, 1.1, 1.3, 1.6, 2.2, 4.0)
"""Of the joint's own torque over the limit; a servo that is clipped below what it needs falls."""


class TorqueSaturation:
    """A limit of the drive's torque, told by its inverse: 0 is no limit but the model's own."""

    name = "torque_saturation"
    title = "the joint's drive gives less torque than the model allows"
    signature = "The joint falls behind while much torque is asked for, one way, and never else."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return one over the limit; searched on a grid, as a limit not reached changes nothing."""
        joint = place_of(subject, place)
        return (
            Quantity(
                "inverse_limit",
                f"1/({joint.torque})",
                0.0,
                10.0 / joint.drive,
                probe=1.2 / joint.drive,
                is_smooth=False,
                grid=tuple(level / joint.drive for level in _LEVELS),
            ),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: every joint may be limited."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Limit what all drives together put on the joint."""
        inverse = float(values[0])
        if inverse <= 0.0:
            return
        joint = row.mj_joint(row.plant.mj_joint(place))
        is_limited, limits = row.field("jnt_actfrclimited"), row.field("jnt_actfrcrange")
        low, high = limits[joint] if is_limited[joint] else (-1.0 / inverse, 1.0 / inverse)
        limits[joint] = max(low, -1.0 / inverse), min(high, 1.0 / inverse)
        is_limited[joint] = 1.0


EFFECT = TorqueSaturation()
