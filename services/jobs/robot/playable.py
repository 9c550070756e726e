"""Whether a site's robot may be taken along a recording programme: arm, start, places, speeds."""

from pathlib import Path

import numpy as np

from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.robot_io.poses import Pose, distance, length, pose_of, rotation_between
from services.robot_io.scene import PROTAGONIST, blade_of
from shared.config.site import load_section
from shared.errors import ConfigError
from shared.identification.excitation.limits import Blade, ToolLimits, tool_hurry
from shared.identification.excitation.motions import PERIOD
from shared.identification.excitation.reading import PosePlan, Stretch
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.twin import Twin, command_of

START_M = 0.02
START_RAD = 0.1
"""A programme begins this close to where the robot waits between bouts."""
ROUNDING = 1e-6


def tool_limits(safety: SafetyConfig, model: FencingModel) -> ToolLimits:
    """Return what the safety gate allows."""
    blade = blade_of(model)
    return ToolLimits(
        box_low=safety.box_low,
        box_high=safety.box_high,
        speed=safety.game_speed,
        acceleration=safety.acceleration,
        turn_speed=safety.turn_speed,
        turn_acceleration=safety.turn_acceleration,
        lead=safety.lead,
        turn_lead=safety.turn_lead,
        ceiling=safety.ceiling,
        keep_out=safety.keep_out,
        keep_out_radius=safety.keep_out_radius,
        blade=Blade(blade.direction, blade.front, blade.back, blade.radius),
    )


def check_playable(plan: PosePlan, site: Path | None) -> None:
    """Refuse a programme that this site's robot cannot be taken along.

    The gate would hold the robot at each limit all the same; this says so before it moves.

    Raises:
        ConfigError: says which recording, which value, and what is allowed.
    """
    sim = load_section(site, "sim", SimConfig)
    robot = load_section(site, "robot_io", RobotIoConfig)
    if plan.arm != sim.arms[PROTAGONIST]:
        raise ConfigError(
            f"{plan.folder} is for the {plan.arm} arm, the robot plays with its "
            f"{sim.arms[PROTAGONIST]} one (sim.arms): design it with --arm {sim.arms[PROTAGONIST]}"
        )
    if sim.control_timestep != PERIOD:
        raise ConfigError(
            f"{plan.folder} has a pose every {PERIOD:g} s, robot_io ticks every "
            f"{sim.control_timestep:g} s (sim.control_timestep)"
        )
    if not robot.return_home:
        raise ConfigError(
            "robot_io.return_home is false: it takes the robot to where recordings begin"
        )
    model = FencingModel.build(sim)
    home = Twin(model, command_of(1.0, 0.0), robot.twin_force, person=True).tools()[PROTAGONIST]
    tool = tool_limits(load_section(site, "safety", SafetyConfig), model)
    for stretch in plan.stretches:
        _check_start(stretch, pose_of(stretch.poses[0]), pose_of(home))
        _check_limits(stretch, tool)


def _check_start(stretch: Stretch, start: Pose, home: Pose) -> None:
    off = distance(start.position, home.position)
    turn = length(rotation_between(home.orientation, start.orientation))
    if off > START_M or turn > START_RAD:
        raise ConfigError(
            f"{stretch.name} begins {100 * off:.1f} cm and {turn:.2f} rad from where the robot "
            f"waits (allowed are {100 * START_M:g} cm and {START_RAD:g} rad): it was designed "
            "for another robot, design it again for this site with --site"
        )


def _check_limits(stretch: Stretch, tool: ToolLimits) -> None:
    again = "design it again with riposte identify excite --site SITE"
    clearance = tool.clearance(stretch.poses)
    if (least := float(clearance.min())) < -ROUNDING:
        at = PERIOD * int(np.argmin(clearance))
        raise ConfigError(
            f"{stretch.name} is {-1000 * least:.0f} mm outside of where the tool and its bat may "
            f"be ([safety]), {at:.2f} s after its start: {again}"
        )
    if (hurry := tool_hurry(tool, stretch.poses, PERIOD)) > 1.0 + ROUNDING:
        raise ConfigError(
            f"{stretch.name} is {hurry:.2f} times as fast as [safety] allows: {again}"
        )
    if stretch.lead > tool.lead or stretch.turn_lead > tool.turn_lead:
        raise ConfigError(
            f"{stretch.name} runs up to {stretch.lead:.3f} m and {stretch.turn_lead:.2f} rad ahead "
            f"of the tool; [safety] allows {tool.lead:g} m and {tool.turn_lead:g} rad: {again}"
        )
