"""What every link stands in: the bat as the gate knows it, the torso's place, the person's seat."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from services.robot_io.config import RobotIoConfig
from services.robot_io.limits import Blade
from services.robot_io.poses import Pose, pose_of
from services.robot_io.trackers import PageTracker, ReplayTracker, Tracker
from services.robot_io.vive.frames import heading
from shared.bus.base import Bus
from shared.sim.model import FencingModel
from shared.sim.twin import Twin, command_of

PROTAGONIST = 1

OpenVive = Callable[[Pose, Pose], Tracker]
"""Opens a Vive tracker: torso frame in the world, where its bat is shown until it is seen."""


def blade_of(model: FencingModel) -> Blade:
    """Return the bat in the tool's frame."""
    angle = model.parameters.bat.mount_angle
    return Blade(
        direction=(float(np.cos(angle)), 0.0, float(np.sin(angle))),
        front=model.bat_front,
        back=model.bat_back,
        radius=model.bat_radius,
    )


def torso_of(model: FencingModel) -> Pose:
    """Return the robot's torso frame in the world."""
    x, y, z = model.base_position[PROTAGONIST]
    return heading((float(x), float(y), float(z)), model.base_yaw[PROTAGONIST])


def person_tracker(
    cfg: RobotIoConfig, model: FencingModel, bus: Bus, open_vive: OpenVive | None
) -> Tracker:
    """Return what follows the bat of a person.

    Raises:
        ConfigError: a recording cannot be read, or a device's library is missing.
    """
    if cfg.tracker == "replay":
        return ReplayTracker.load(Path(cfg.replay))
    # Until somebody says where the bat is, it stands where a robot's would.
    start = Twin(model, command_of(1.0, 0.0), cfg.twin_force, person=False).bat(0)
    if cfg.tracker == "vive" and open_vive is not None:
        return open_vive(torso_of(model), pose_of(start[:7]))
    return PageTracker(bus, pose_of(start[:7]))
