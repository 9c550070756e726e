"""The place of the game as numbers, for those who judge or play in it without any physics.

Importing this does not import MuJoCo; a test holds it against the compiled model.
"""

import math
from typing import Final

from shared.game.geometry import BatShape, Target
from shared.policy.action import ActionConfig
from shared.policy.scripted.sight import Arena
from shared.sim.config import SimConfig
from shared.sim.parameters import load_parameters

BASE_YAW: Final = (math.pi, 0.0)
"""The antagonist stands at +x and looks along -x (rad)."""


def bat_of(cfg: SimConfig) -> BatShape:
    """Return the shape of both bats.

    Raises:
        ConfigError: if the model file cannot be used.
    """
    bat = load_parameters(cfg.model).bat
    return BatShape(-bat.behind_grip, bat.length - bat.behind_grip, bat.radius)


def target_of(cfg: SimConfig) -> Target:
    """Return the target, in the world frame."""
    return Target((0.0, 0.0, cfg.target_height), cfg.target_radius)


def arena_of(cfg: SimConfig, action: ActionConfig) -> Arena:
    """Return what a scripted player has to know of the game.

    Raises:
        ConfigError: if the model file cannot be used.
    """
    return Arena(
        bat=bat_of(cfg),
        target_radius=cfg.target_radius,
        offset_bound_m=action.offset_bound_m,
        offset_bound_rad=action.offset_bound_rad,
        control_timestep=cfg.control_timestep,
    )
