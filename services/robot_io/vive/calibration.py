"""Where the base stations stand to the robot: the file that a calibration leaves.

``riposte robot calibrate`` writes it, robot_io reads it when it starts.
"""

import datetime
import math
from pathlib import Path

import msgspec
import tomli_w

from services.robot_io.poses import Pose, Quaternion, Vector, is_pose, unit
from shared.config import toml
from shared.errors import ConfigError
from shared.runtime.files import atomic_write

SCHEMA = 1
ADVICE = "run riposte robot calibrate"
SECONDS_A_DAY = 86400.0


class Frame(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A pose in a file."""

    position: Vector
    """m."""
    orientation: Quaternion
    """w x y z."""

    @property
    def pose(self) -> Pose:
        """Return it as a pose, its quaternion at unit length."""
        return Pose(self.position, unit(self.orientation))


class Calibration(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The result of one calibration, and how good it is."""

    schema: int = SCHEMA
    made_at: datetime.datetime
    """With its time zone."""
    serial: str
    """Of the tracker that was on the gripper."""
    torso_from_base: Frame
    """The base stations' frame in the torso frame of the robot."""
    tracker_from_tool: Frame
    """How the tracker was mounted on the gripper."""
    poses: int
    """Used."""
    rejected: int
    """Left out, for they fit no rigid mounting."""
    residual_mm: float
    """Root mean square over the poses used (mm)."""
    held_out_mm: float
    """The same over poses that the fit did not see."""
    expected_mm: float
    """Expected error of a bat within a metre, from the residuals and the poses' spread."""
    spread_deg: float
    """How far the gripper was turned about the axis it was turned about least (RMS)."""
    dock: Vector | None = None
    """Tracker of a bat that lies in its dock, in the base stations' frame (m)."""

    def age_days(self, wall_ns: int) -> float:
        """Return how old it is (days); negative where a clock was put back."""
        return (wall_ns * 1e-9 - self.made_at.timestamp()) / SECONDS_A_DAY

    def check_age(self, wall_ns: int, limit: float) -> None:
        """Check that it is not older than ``limit`` days.

        Raises:
            ConfigError: it is, or it is from the future.
        """
        age = self.age_days(wall_ns)
        if age > limit:
            raise ConfigError(f"calibration too old: {age:.1f} days, limit {limit:g}: {ADVICE}")
        if age < -1.0:
            raise ConfigError(
                f"the calibration is of {self.made_at:%Y-%m-%d}, which is {-age:.0f} days ahead: "
                f"set this machine's clock, or {ADVICE}"
            )

    def describe(self, wall_ns: int) -> str:
        """Return it in one line."""
        return (
            f"calibrated {self.age_days(wall_ns):.1f} days ago on {self.poses} poses, "
            f"{self.held_out_mm:.1f} mm on poses held out"
        )


def load_calibration(path: Path) -> Calibration:
    """Return the calibration in a file.

    Raises:
        ConfigError: it is missing, damaged, of another schema, or not made of numbers.
    """
    try:
        found = toml.decode(path.read_bytes(), Calibration)
    except FileNotFoundError as error:
        raise ConfigError(f"no calibration {path}: {ADVICE}") from error
    except OSError as error:
        raise ConfigError(f"cannot read the calibration {path}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"the calibration {path} is damaged ({error}): {ADVICE}") from error
    if found.schema != SCHEMA:
        raise ConfigError(
            f"the calibration {path} has schema {found.schema}, expected {SCHEMA}: {ADVICE}"
        )
    if found.made_at.tzinfo is None:
        raise ConfigError(f"made_at of {path} has no time zone: {ADVICE}")
    for name in ("torso_from_base", "tracker_from_tool"):
        frame: Frame = getattr(found, name)
        if not is_pose(Pose(frame.position, frame.orientation)):
            raise ConfigError(f"{name} of {path} is not a pose: {ADVICE}")
    if found.dock is not None and not all(map(math.isfinite, found.dock)):
        raise ConfigError(f"dock of {path} is not finite: {ADVICE}")
    return found


def save_calibration(path: Path, calibration: Calibration) -> None:
    """Write it, whole or not at all.

    Raises:
        RiposteError: the folder cannot be written, or the disk is full; the old file is intact.
    """
    table = {
        name: value
        for name, value in msgspec.to_builtins(
            calibration, builtin_types=(datetime.datetime,)
        ).items()
        if value is not None
    }
    atomic_write(path, tomli_w.dumps(table).encode())
