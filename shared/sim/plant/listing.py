"""What an MJCF file has: joints, their ranges, and where it stands."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from shared.errors import IdentificationError
from shared.sim.arm import Float64

_TURN = np.pi
"""Either side of home, of a hinge without a range (rad)."""
_SLIDE = 0.5
"""The same of a slide (m)."""


@dataclass(frozen=True)
class Listing:
    """The joints of an MJCF file that a log may have."""

    joints: tuple[str, ...]
    is_sliding: tuple[bool, ...]
    home: Float64
    """float64[J], of the first keyframe, or as the file has them (rad, m)."""
    low: Float64
    """float64[J], of the joint's range and its servo's (rad, m)."""
    high: Float64
    """float64[J]."""
    effort: Float64
    """float64[J], largest torque (N m, N); inf where the file has none."""
    has_servos: bool
    """Whether its actuators take positions."""


def listing_of(path: Path) -> Listing:
    """Return what a file has.

    Raises:
        IdentificationError: it cannot be read, or has a joint that is no hinge or slide.
    """
    try:
        spec: Any = mujoco.MjSpec  # its stub lacks from_file
        model: mujoco.MjModel = spec.from_file(str(path)).compile()
    except ValueError as error:
        raise IdentificationError(f"MuJoCo refused {path}: {error}") from None
    kinds = [int(kind) for kind in model.jnt_type]
    slide, hinge = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
    names = tuple(model.joint(index).name for index in range(model.njnt))
    for name, kind in zip(names, kinds, strict=True):
        if kind not in (slide, hinge):
            raise IdentificationError(f"{path}: joint {name!r} is no hinge or slide")
    if not names:
        raise IdentificationError(f"{path} has no joints")
    places = np.array([int(adr) for adr in model.jnt_qposadr])
    home = np.array((model.key_qpos[0] if model.nkey else model.qpos0)[places], np.float64)
    wide = np.where(np.array(kinds) == slide, _SLIDE, _TURN)
    is_limited = np.array(model.jnt_limited, bool)
    low = np.where(is_limited, model.jnt_range[:, 0], home - wide)
    high = np.where(is_limited, model.jnt_range[:, 1], home + wide)
    effort = np.where(np.array(model.jnt_actfrclimited, bool), model.jnt_actfrcrange[:, 1], np.inf)
    affine = int(mujoco.mjtBias.mjBIAS_AFFINE)
    has_servos = model.nu > 0 and all(int(bias) == affine for bias in model.actuator_biastype)
    for index in range(model.nu):
        if int(model.actuator_trntype[index]) != int(mujoco.mjtTrn.mjTRN_JOINT):
            continue
        joint = int(model.actuator_trnid[index, 0])
        gear = abs(float(model.actuator_gear[index, 0]))
        if model.actuator_forcelimited[index]:
            most = gear * float(model.actuator_forcerange[index, 1])
            effort[joint] = min(effort[joint], most)
        if model.actuator_ctrllimited[index]:
            lowest, highest = (float(value) for value in model.actuator_ctrlrange[index])
            if has_servos:
                low[joint], high[joint] = max(low[joint], lowest), min(high[joint], highest)
            else:
                effort[joint] = min(effort[joint], gear * highest)
    return Listing(
        joints=names,
        is_sliding=tuple(kind == slide for kind in kinds),
        home=home,
        low=low,
        high=high,
        effort=effort,
        has_servos=has_servos,
    )
