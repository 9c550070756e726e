"""A PR2's parameters, read back from the fields of its compiled model."""

from collections.abc import Callable, Mapping
from typing import Final

import msgspec
import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.build import AGENTS
from shared.sim.config import JointName
from shared.sim.parameters import (
    JOINT_NAMES,
    ArmParameters,
    Axis,
    AxisGains,
    Extension,
    Gains,
    JointParameters,
    LinkMass,
    ModelParameters,
    ResidualSpring,
    ServoParameters,
    TorqueBias,
)

FIELDS: Final = frozenset(
    {
        "dof_damping", "dof_dampingpoly", "dof_frictionloss", "dof_armature", "jnt_actfrcrange",
        "jnt_actfrclimited", "jnt_stiffness", "qpos_spring", "actuator_gainprm",
        "actuator_biasprm", "body_mass", "body_inertia",
    }
)  # fmt: skip
"""Of ``mjModel``: all that a ``model.toml`` can say of an arm."""

_AGENT: Final = AGENTS[1]
_AXES: Final[tuple[Axis, ...]] = ("x", "y", "z")
_SOFT: Final = 1e-6
"""A spring that is softer stands for a constant torque (N m/rad)."""
_FAR: Final = 6.28
"""A spring whose rest is further away is written as one about 0 and a constant torque (rad)."""


def pr2_parameters(
    nominal: ModelParameters, model: mujoco.MjModel, fields: Mapping[str, Float64]
) -> ModelParameters:
    """Return the parameters whose arm has the given fields.

    Args:
        nominal: what ``model`` was built of.
        model: one arm, as ``plant.pr2`` makes it.
        fields: those of :data:`FIELDS` that changed, whole.

    Raises:
        ValueError: a value is outside of what a model may have; names it.
    """

    def field(name: str) -> Float64:
        return fields.get(name, np.asarray(getattr(model, name), np.float64))

    joints: dict[str, JointParameters] = {}
    extensions: list[Extension] = []
    for name in JOINT_NAMES:
        joint = model.joint(f"{_AGENT}/{name}")
        index, dof, body = joint.id, int(joint.dofadr[0]), int(joint.bodyid[0])
        curve = field("dof_dampingpoly").reshape(model.nv, -1)[dof]
        joints[name] = JointParameters(
            damping=(float(field("dof_damping")[dof]), float(curve[0]), float(curve[1])),
            friction_loss=float(field("dof_frictionloss")[dof]),
            armature=float(field("dof_armature")[dof]),
            torque_limit=float(field("jnt_actfrcrange").reshape(-1, 2)[index, 1]),
        )
        extensions += _springs(
            name,
            float(field("jnt_stiffness").reshape(model.njnt, -1)[index, 0]),
            float(field("qpos_spring")[int(joint.qposadr[0])]),
        )
        known = nominal.of_kind(LinkMass, name)
        factor = float(field("body_mass")[body] / model.body_mass[body])
        factor *= 1.0 if known is None else known.factor
        if factor != 1.0:
            extensions.append(LinkMass(joint=name, factor=factor))
    gains = {axis: _gains(model, field, axis) for axis in (*_AXES, "orientation")}
    if gains["x"] == gains["y"] == gains["z"]:
        translation = gains["x"]
    else:
        translation = Gains(
            kp=float(np.mean([gains[axis].kp for axis in _AXES])),
            kv=float(np.mean([gains[axis].kv for axis in _AXES])),
        )
        extensions += [AxisGains(axis=axis, kp=gains[axis].kp, kv=gains[axis].kv) for axis in _AXES]
    return msgspec.structs.replace(
        nominal,
        joints=ArmParameters(**joints),
        servo=ServoParameters(translation=translation, orientation=gains["orientation"]),
        extensions=tuple(extensions),
    )


def _springs(joint: JointName, stiffness: float, rest: float) -> list[Extension]:
    """Return what the one spring of a joint stands for."""
    if stiffness == 0.0:
        return []
    if stiffness <= _SOFT:
        return [TorqueBias(joint=joint, torque=stiffness * rest)]
    if abs(rest) <= _FAR:
        return [ResidualSpring(joint=joint, stiffness=stiffness, angle=rest)]
    spring = ResidualSpring(joint=joint, stiffness=stiffness, angle=0.0)
    return [spring, TorqueBias(joint=joint, torque=stiffness * rest)]


def _gains(model: mujoco.MjModel, field: Callable[[str], Float64], axis: Axis) -> Gains:
    actuator = int(model.actuator(f"{_AGENT}/{axis}").id)
    return Gains(
        kp=float(field("actuator_gainprm")[actuator, 0]),
        kv=-float(field("actuator_biasprm")[actuator, 2]),
    )
