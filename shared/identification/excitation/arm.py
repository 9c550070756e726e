"""The arm that a programme is made for: where it stands, how far it may go, its nominal model."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from shared.errors import IdentificationError
from shared.identification.dataset.types import Control, Float64, ModelSource
from shared.identification.excitation.limits import Limits, ToolLimits
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.listing import listing_of
from shared.sim.plant.plant import Plant, mjcf, pr2
from shared.sim.plant.rollouts import Rollouts

TIMESTEP = 0.005
"""Of a PR2's physics: a prediction need not be as exact as a fit (s)."""
_CAPACITY = 64
_REACH = 0.9
"""Of the way from home to a joint's limit."""
_FURTHEST = 0.7
"""Of a PR2's joint from home (rad)."""
_WIDEST = 1.2
"""Of another arm's joint from home (rad)."""
_MIDDLE = 0.3
"""Of a joint's range: home is moved no closer than this to either end."""
_JERKY = 0.1
"""Joints reach full speed within this long (s)."""


@dataclass(frozen=True)
class Arm:
    """An arm to move."""

    source: ModelSource
    plant: Plant
    rollouts: Rollouts
    """Of the nominal model."""
    home: Float64
    """float64[J], posture that every recording begins and ends in (rad, m)."""
    reach: Float64
    """float64[J], how far from there it goes at most (rad, m)."""
    limits: Limits

    def poses(self, q: Float64) -> Float64:
        """Return float64[T, 7], where the tool is at postures float64[T, J]."""
        return tool_poses(self.plant, self.rollouts.model, q)


def pr2_arm(side: Literal["right", "left"], parameters: Path | None, tool: ToolLimits) -> Arm:
    """Return an arm of a PR2, en garde.

    Args:
        side: which.
        parameters: a ``model.toml``; None is the nominal model.
        tool: what its safety gate allows.
    """
    plant = pr2(side, parameters, TIMESTEP)
    rollouts = Rollouts(plant, (), _CAPACITY)
    home = FencingModel.build(SimConfig(arms=(side, side))).en_garde[1].copy()
    model = rollouts.model
    joints = [model.joint(name) for name in plant.joints]
    ids = np.array([int(joint.id) for joint in joints])
    is_limited = np.array(model.jnt_limited, bool)[ids]
    low = np.where(is_limited, model.jnt_range[ids, 0], -np.inf)
    high = np.where(is_limited, model.jnt_range[ids, 1], np.inf)
    limits = Limits(
        low=low,
        high=high,
        speed=np.full(len(ids), np.inf),
        acceleration=np.full(len(ids), np.inf),
        effort=np.array(model.jnt_actfrcrange[ids, 1], np.float64),
        tool=tool,
    )
    reach = np.minimum(_REACH * np.minimum(home - low, high - home), _FURTHEST)
    source = ModelSource(kind="pr2", arm=side, parameters=parameters)
    return Arm(source, plant, rollouts, home, reach, limits)


def mjcf_arm(
    path: Path, control: Control | None, tracked: str, speed: float, tool: ToolLimits | None
) -> Arm:
    """Return the arm of an MJCF file, at its first keyframe or as the file has it.

    Joints that stand close to an end of their range begin further inside.

    Args:
        path: the file.
        control: ``position`` or ``torque``; None is what the file's actuators take.
        tracked: site or body that a tracker is fixed to.
        speed: of the fastest joint (rad/s, and half of it in m/s for a slide).
        tool: where the tool may go, in the world of the file.

    Raises:
        IdentificationError: the file cannot be used.
    """
    found = listing_of(path)
    if control == "pose":
        raise IdentificationError("an MJCF takes positions or torques; poses are for a PR2")
    kind: Control = control or ("position" if found.has_servos else "torque")
    plant = mjcf(path, kind, found.joints, found.joints, tracked)
    inside = _MIDDLE * (found.high - found.low)
    home = np.clip(found.home, found.low + inside, found.high - inside)
    speeds = np.where(found.is_sliding, 0.5 * speed, speed)
    limits = Limits(
        low=found.low,
        high=found.high,
        speed=speeds,
        acceleration=speeds / _JERKY,
        effort=found.effort,
        tool=tool,
    )
    margin = np.minimum(home - found.low, found.high - home)
    widest = np.where(found.is_sliding, 0.5 * _WIDEST, _WIDEST)
    source = ModelSource(kind="mjcf", path=path, tracked=tracked)
    reach = np.minimum(_REACH * margin, widest)
    return Arm(source, plant, Rollouts(plant, (), _CAPACITY), home, reach, limits)
