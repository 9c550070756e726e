"""Settings of a fake PR2."""

from typing import Any, Final

import msgspec

from shared.sim.arm import load_arm
from shared.sim.config import SimConfig
from shared.testing.fake_pr2 import arm_hold, jt_cartesian

ROOT: Final = "torso_lift_link"
"""The torso frame, in which all poses are."""


class FakePr2Config(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One robot, as it is after its own start-up."""

    sim: SimConfig = SimConfig()
    """The scene, of which the protagonist's arm counts."""
    port: int = 0
    """Of the ROS master; 0 takes a free one."""
    command_delay: float = 0.003
    """From a command's arrival to its effect (s). With the wire, and with 100 commands a second,
    a sine of 0.7 Hz is then 7.5 ms late in x_desi and 100 ms in x_desi_filtered, as measured."""
    auto_restart: bool = True
    """Whether pr2_run_stop_auto_restart runs, as it does on a stock robot."""
    running: tuple[str, ...] = (
        "r_arm_controller", "l_arm_controller", "r_gripper_controller", "head_traj_controller",
    )  # fmt: skip
    """Controllers loaded and started at the beginning, where their parameters are set."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        if not 0 <= self.port <= 65535:
            raise ValueError(f"port is {self.port}; allowed are 0 to 65535")
        if not 0.0 <= self.command_delay <= 0.1:  # also refuses NaN
            raise ValueError(f"command_delay is {self.command_delay:g}; allowed are 0 to 0.1")

    @property
    def prefix(self) -> str:
        """Return what the names of the arm's joints and controllers begin with."""
        return f"{self.sim.arms[1][0]}_"


def shipped_parameters(cfg: FakePr2Config) -> dict[str, dict[str, Any]]:
    """Return what a robot's launch files leave on the parameter server, by namespace.

    ``pr2_arm_controllers.yaml`` and ``pr2_jt_controllers.launch`` of pr2_controller_configuration,
    as far as somebody here reads it. ``saturation`` is not among it, and ``joint_max_effort``,
    which is, is not read.
    """
    prefix, arm = cfg.prefix, load_arm(cfg.sim.arms[1])
    names = [f"{prefix}{joint.name}_joint" for joint in arm.joints]
    return {
        "pr2_controller_manager": {
            "joint_state_publish_rate": 100.0,
            "mechanism_statistics_publish_rate": 1.0,
        },
        "r_arm_controller": _arm_controller("r_"),
        "l_arm_controller": _arm_controller("l_"),
        "head_traj_controller": {
            "type": arm_hold.TYPE,
            "joints": ["head_pan_joint", "head_tilt_joint"],
        },
        "r_gripper_controller": {
            "type": "pr2_mechanism_controllers/Pr2GripperController",
            "joint": "r_gripper_joint",
        },
        f"{prefix}cart": {
            "type": jt_cartesian.TYPE,
            "root_name": ROOT,
            "tip_name": f"{prefix}gripper_tool_frame",
            "k_posture": 25.0,
            "jacobian_inverse_damping": 0.01,
            "pose_command_filter": 0.01,
            "cart_gains": {"trans": {"p": 800.0, "d": 15.0}, "rot": {"p": 80.0, "d": 1.2}},
            "joint_feedforward": {
                name: joint.feedforward for name, joint in zip(names, arm.joints, strict=True)
            },
            "joint_max_effort": {
                name: joint.continuous_torque for name, joint in zip(names, arm.joints, strict=True)
            },
            "vel_saturation_trans": 2.0,
            "vel_saturation_rot": 4.0,
        },
    }


def _arm_controller(prefix: str) -> dict[str, Any]:
    names = [f"{prefix}{joint.name}_joint" for joint in load_arm("right").joints]
    gains = [msgspec.to_builtins(gain) for gain in arm_hold.SHIPPED]
    return {
        "type": arm_hold.TYPE,
        "joints": names,
        "gains": dict(zip(names, gains, strict=True)),
    }
