"""What of the robot's state is said to those who record and identify."""

import numpy as np

from services.robot_io.links import RobotState
from shared.messages.robot import RobotReport

LONGEST_AGE = 3600.0
"""A state of the robot that claims to be older has no time of its own (s)."""


def report_of(robot: RobotState, tick: int, boot: str, now: float, wall_ns: int) -> RobotReport:
    """Return the report of a state.

    Args:
        robot: as its link read it.
        tick: of the loop.
        boot: of robot_io.
        now: our monotonic clock, as ``robot.at`` (s).
        wall_ns: the wall clock at the same instant.
    """
    efforts, age = robot.joint_efforts, now - robot.at
    is_told = efforts is not None and bool(np.isfinite(efforts).all())
    return RobotReport(
        tick=tick,
        boot=boot,
        at_ns=wall_ns - (round(1e9 * age) if 0.0 <= age < LONGEST_AGE else 0),
        speed=robot.speed,
        force=robot.force,
        effort_share=robot.effort_share,
        is_run_stopped=robot.is_run_stopped,
        are_motors_halted=robot.are_motors_halted,
        generation=robot.generation,
        problems=robot.problems,
        efforts=efforts if is_told and efforts is not None else np.zeros(0),
    )
