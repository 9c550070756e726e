"""Whether the controller was set up as this software expects: its parameters, read back.

The controller reads them when it is loaded. One that is set afterwards reads back well and has no
effect, so after a change the controller is to be loaded anew.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Final

from services.robot_io.pr2.config import Pr2Config

ROOT: Final = "torso_lift_link"
_TOLERANCE: Final = 1e-6


def parameter_problems(
    found: Any, cfg: Pr2Config, joints: Sequence[str], efforts: Sequence[float]
) -> list[str]:
    """Return what is wrong with a controller's parameters.

    Args:
        found: all that the parameter server has in its namespace; None where it has nothing.
        cfg: what is expected.
        joints: names of the arm's joints.
        efforts: their limits (N m; URDF).
    """
    space = f"/{cfg.controller}"
    if not isinstance(found, Mapping):
        return [f"{space} has no parameters: roslaunch the JT controllers"]
    problems: list[str] = []
    for path, expected in (
        ("cart_gains/trans/p", cfg.kp_trans), ("cart_gains/trans/d", cfg.kd_trans),
        ("cart_gains/rot/p", cfg.kp_rot), ("cart_gains/rot/d", cfg.kd_rot),
        ("pose_command_filter", cfg.pose_command_filter),
        ("vel_saturation_trans", cfg.vel_saturation_trans),
        ("vel_saturation_rot", cfg.vel_saturation_rot),
    ):  # fmt: skip
        value = _at(found, path)
        if not _is_number(value) or not math.isclose(value, expected, rel_tol=_TOLERANCE):
            problems.append(
                f"parameter {space}/{path} is {_said(value)}, expected {expected:g}: set it and "
                f"load {cfg.controller} again, or change [pr2] in the site file"
            )
    if (root := _at(found, "root_name")) != ROOT:
        problems.append(f"parameter {space}/root_name is {_said(root)}, expected {ROOT}")
    problems += _saturation_problems(found, cfg, joints, efforts)
    return problems


def _saturation_problems(
    found: Any, cfg: Pr2Config, joints: Sequence[str], efforts: Sequence[float]
) -> list[str]:
    bad: list[str] = []
    for joint, limit in zip(joints, efforts, strict=True):
        value = _at(found, f"saturation/{joint}")
        if not _is_number(value) or not 0.0 < value <= limit:
            bad.append(f"{joint} {_said(value)}")
    if not bad:
        return []
    return [
        f"/{cfg.controller}/saturation must bound every joint's effort (0 to "
        f"{max(efforts):g} N m; joint_max_effort is not read), but has {', '.join(bad)}: set it "
        f"and load {cfg.controller} again"
    ]


def _at(found: Any, path: str) -> Any:
    for name in path.split("/"):
        if not isinstance(found, Mapping):
            return None
        found = found.get(name)  # pyright: ignore[reportUnknownVariableType, reportUnknownMemberType]
    return found  # pyright: ignore[reportUnknownVariableType]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _said(value: Any) -> str:
    return "not set" if value is None else str(value)[:40]
