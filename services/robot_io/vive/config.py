"""Settings of the Vive tracker: section ``[vive]`` of a site file."""

import math

import msgspec

from services.robot_io.poses import Pose, Quaternion, Vector
from shared.config.ranges import check_ranges


class ViveConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The tracker on a person's bat; robot_io with ``tracker = "vive"`` reads it."""

    serial: str = ""
    """Of the tracker, as SteamVR shows it: LHR-01234567."""
    calibration: str = "vive.toml"
    """File that `riposte robot calibrate` writes and robot_io reads."""
    calibration_days: float = 30.0
    """An older calibration is not used (days)."""
    mount_position: Vector = (0.0, 0.0, 0.0)
    """Where the bat's frame lies in the tracker's: the middle of the grip (m)."""
    mount_orientation: Quaternion = (1.0, 0.0, 0.0, 0.0)
    """How it is turned there (w x y z): the bat's x runs along the blade."""
    dock_limit: float = 0.02
    """A bat further than this from where its dock was recorded is not believed (m)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        check_ranges(self, ("calibration_days", 0.01, 3650.0), ("dock_limit", 0.001, 0.2))
        if not all(abs(number) <= 1.0 for number in self.mount_position):
            raise ValueError(f"mount_position is {self.mount_position}, expected within 1 m")
        if not abs(math.hypot(*self.mount_orientation) - 1.0) <= 0.01:
            raise ValueError(
                f"mount_orientation is {self.mount_orientation}, "
                "expected a quaternion (w x y z) of length 1"
            )
        if not self.calibration:
            raise ValueError("calibration is empty, expected the name of a file")

    @property
    def mount(self) -> Pose:
        """Return the bat in the tracker's frame."""
        return Pose(self.mount_position, self.mount_orientation)
