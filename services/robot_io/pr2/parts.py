"""A PR2 with its gate, and whoever plays against it."""

from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.gate import Gate
from services.robot_io.poses import pose_of
from services.robot_io.pr2.config import Pr2Config
from services.robot_io.pr2.link import Pr2Link
from services.robot_io.pr2.state import BatFrame
from services.robot_io.scene import PROTAGONIST, OpenVive, blade_of, person_tracker, torso_of
from services.robot_io.service import Parts
from shared.bus.base import Bus
from shared.clock import Clock
from shared.sim.arm import load_arm
from shared.sim.build import bat_quaternion
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.twin import Twin, command_of


def pr2_parts(
    cfg: RobotIoConfig, pr2: Pr2Config, safety: SafetyConfig, sim: SimConfig, bus: Bus,
    clock: Clock, open_vive: OpenVive | None = None,
) -> Parts:  # fmt: skip
    """Return the link to the robot and what stands around it.

    Raises:
        ConfigError: a tracker cannot be opened.
        RosError: the master's address or this machine's cannot be.
    """
    model = FencingModel.build(sim)
    arm = load_arm(sim.arms[PROTAGONIST])
    w, x, y, z = (float(number) for number in bat_quaternion(model.parameters.bat))
    tracker = person_tracker(cfg, model, bus, open_vive)
    link = Pr2Link(
        pr2,
        BatFrame(torso_of(model), (w, x, y, z)),
        [f"{arm.side[0]}_{joint.name}_joint" for joint in arm.joints],
        [joint.effort_limit for joint in arm.joints],
        clock,
    )
    home = Twin(model, command_of(1.0, 0.0), cfg.twin_force, person=True).tools()[PROTAGONIST]
    return Parts(
        gate=Gate(safety, blade_of(model), sim.control_timestep),
        link=link,
        tracker=tracker,
        home=pose_of(home),
    )
