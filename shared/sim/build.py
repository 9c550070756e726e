"""Builds the scene: two PR2 robots on their bases, one arm and one bat each.

Only what moves or touches is in the physics model; looks are added by ``visuals.py`` where
somebody looks, so that a training batch never pays for them.
"""

import math
from typing import Final

import mujoco
import numpy as np

from shared.sim.arena import BASE_YAW
from shared.sim.arm import Arm, Float64, Inertial, combine, load_arm, load_stance
from shared.sim.config import JointName, SimConfig
from shared.sim.parameters import (
    AxisGains,
    BatParameters,
    LinkMass,
    ModelParameters,
    ResidualSpring,
    TorqueBias,
)

AGENTS: Final = ("antagonist", "protagonist")
"""Index 0 and 1 wherever agents are in an array."""
CONTROLS: Final = 7
"""Per agent: desired tool position and quaternion (w, x, y, z) in its torso frame."""
SENSORS: Final = 20
"""Per agent: bat position, quaternion, velocities in the world; tool pose in the torso frame."""
ARENA_BYTES: Final = 64_000
"""Scratch memory of one world: twice what every contact, limit and friction row at once needs, and
small enough that 256 worlds stay in the cache."""

_TYPE = mujoco.mjtGeom
_AXES: Final = "xyz"
_STRUCK: Final = {"upper_arm_roll": 0.32, "forearm_roll": 0.26, "wrist_roll": 0.16}
"""Links of an arm that the other's bat can reach, and how long they are (m)."""
_STRUCK_RADIUS: Final = 0.06
_SOFT: Final = 1e-9
"""Stiffness of a spring that stands for a constant torque (N m/rad)."""


def base_position(cfg: SimConfig) -> Float64:
    """Return float64[2, 3]: each agent's torso frame in the world (m)."""
    height = load_stance().torso_height + cfg.torso_lift
    return np.array([[cfg.half_distance, 0.0, height], [-cfg.half_distance, 0.0, height]])


def build_spec(
    cfg: SimConfig,
    parameters: ModelParameters,
    agents: tuple[str, ...] = AGENTS,
    *,
    has_goal_sites: bool = False,
) -> mujoco.MjSpec:
    """Return the physics of the scene, uncompiled.

    Args:
        cfg: the scene and its time steps.
        parameters: the simulator's parameters.
        agents: who stands in the scene, in the order of sensors and controls.
        has_goal_sites: the orientation servo is three actuators about the axes of a site
            ``AGENT/goal``, whose orientation is the command, for simulators without orientation
            actuators: the same torque, with controls that stay zero.
    """
    spec = mujoco.MjSpec()
    spec.modelname = "riposte"
    spec.compiler.degree = False
    spec.memory = ARENA_BYTES
    _set_options(spec, cfg)
    for agent in agents:
        _add_robot(spec, cfg, parameters, agent)
    for agent in agents:
        _add_servo(spec, parameters, agent, has_goal_sites=has_goal_sites)
        _add_sensors(spec, agent)
    if len(agents) == 2:
        _add_contacts(spec, cfg)
    return spec


def _set_options(spec: mujoco.MjSpec, cfg: SimConfig) -> None:
    option = spec.option
    option.timestep = cfg.physics_timestep
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
    # Never sparse: 4.0.0 factorizes wrongly there, and dense is faster at 14 velocities.
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    # The arms are counterbalanced by springs and nothing moves freely, so there is no gravity.
    # A diverged world must stay as it is, to be found and dumped.
    # Looking for islands costs more than solving them apart saves: 8 % of a step of two arms.
    off = mujoco.mjtDisableBit
    option.disableflags |= int(off.mjDSBL_GRAVITY) | int(off.mjDSBL_AUTORESET)
    option.disableflags |= int(off.mjDSBL_ISLAND)


def _add_robot(
    spec: mujoco.MjSpec, cfg: SimConfig, parameters: ModelParameters, agent: str
) -> None:
    index = AGENTS.index(agent)
    arm = load_arm(cfg.arms[index])
    yaw = BASE_YAW[index]
    body = spec.worldbody.add_body(
        name=f"{agent}/torso",
        pos=base_position(cfg)[index],
        quat=[math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)],
    )
    body.add_site(name=f"{agent}/torso")
    for joint in arm.joints:
        body = body.add_body(name=f"{agent}/{joint.name}", pos=joint.origin)
        values = parameters.joints[joint.name]
        hinge = body.add_joint(
            name=f"{agent}/{joint.name}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=joint.axis
        )
        hinge.damping[:] = values.damping
        hinge.frictionloss = values.friction_loss
        hinge.armature = values.armature
        hinge.actfrcrange = [-values.torque_limit, values.torque_limit]
        if joint.range is not None:
            hinge.range = joint.range
        _add_spring(hinge, parameters, joint.name)
        inertial = joint.inertial
        if joint.name == "wrist_roll":
            inertial = combine([inertial, bat_inertial(parameters.bat, arm)])
        if (link := parameters.of_kind(LinkMass, joint.name)) is not None:
            heavy = inertial.inertia * link.factor
            inertial = Inertial(inertial.mass * link.factor, inertial.com, heavy)
        _set_inertial(body, inertial)
        if cfg.bat_arm_contacts and joint.name in _STRUCK:
            body.add_geom(
                name=f"{agent}/{joint.name}",
                type=_TYPE.mjGEOM_CAPSULE,
                fromto=[0.0, 0.0, 0.0, _STRUCK[joint.name], 0.0, 0.0],
                size=[_STRUCK_RADIUS, 0.0, 0.0],
                contype=0,
                conaffinity=0,
            )
    body.add_site(name=f"{agent}/tool", pos=arm.tool)
    _add_bat(body, parameters.bat, arm, agent)


def _add_spring(hinge: mujoco.MjsJoint, parameters: ModelParameters, joint: JointName) -> None:
    """Add what acts on a joint by its position alone, as the one spring that a hinge may have.

    A constant torque is a very soft spring far off.
    """
    spring = parameters.of_kind(ResidualSpring, joint)
    bias = parameters.of_kind(TorqueBias, joint)
    if bias is None:
        if spring is not None:
            hinge.stiffness[0] = spring.stiffness
            hinge.springref = spring.angle
        return
    stiffness = _SOFT if spring is None else max(spring.stiffness, _SOFT)
    at_zero = bias.torque + (0.0 if spring is None else spring.stiffness * spring.angle)
    hinge.stiffness[0] = stiffness
    hinge.springref = at_zero / stiffness


def _set_inertial(body: mujoco.MjsBody, inertial: Inertial) -> None:
    full = inertial.inertia
    body.explicitinertial = True
    body.mass = inertial.mass
    body.ipos = inertial.com
    body.fullinertia = [full[0, 0], full[1, 1], full[2, 2], full[0, 1], full[0, 2], full[1, 2]]


def bat_quaternion(bat: BatParameters) -> Float64:
    """Return float64[4]: the bat's frame (+x along the blade) in the tool frame (w, x, y, z)."""
    half = -bat.mount_angle / 2  # a positive turn about y takes +x towards -z
    return np.array([math.cos(half), 0.0, math.sin(half), 0.0])


def bat_inertial(bat: BatParameters, arm: Arm) -> Inertial:
    """Return the bat as a solid cylinder, in the frame of the gripper's joint."""
    along = np.array([math.cos(bat.mount_angle), 0.0, math.sin(bat.mount_angle)])
    middle = bat.length / 2 - bat.behind_grip
    axial = bat.mass * bat.radius**2 / 2
    across = bat.mass * (3 * bat.radius**2 + bat.length**2) / 12
    inertia = across * np.eye(3) + (axial - across) * np.outer(along, along)
    return Inertial(bat.mass, np.array(arm.tool) + middle * along, inertia)


def _add_bat(body: mujoco.MjsBody, bat: BatParameters, arm: Arm, agent: str) -> None:
    quaternion = bat_quaternion(bat)
    along = np.array([math.cos(bat.mount_angle), 0.0, math.sin(bat.mount_angle)])
    grip = np.array(arm.tool)
    back, front = grip - bat.behind_grip * along, grip + (bat.length - bat.behind_grip) * along
    body.add_site(name=f"{agent}/bat", pos=arm.tool, quat=quaternion)
    body.add_geom(
        name=f"{agent}/bat",
        type=_TYPE.mjGEOM_CAPSULE,
        fromto=[*back, *front],
        size=[bat.radius, 0.0, 0.0],
        contype=0,
        conaffinity=0,
    )


def _add_servo(
    spec: mujoco.MjSpec, parameters: ModelParameters, agent: str, *, has_goal_sites: bool
) -> None:
    """Add the agent's 7 controls: three translations and an orientation of its tool."""
    translation, orientation = parameters.servo.translation, parameters.servo.orientation
    target, reference = f"{agent}/tool", f"{agent}/torso"
    for axis in range(3):
        servo = spec.add_actuator(
            name=f"{agent}/{_AXES[axis]}",
            trntype=mujoco.mjtTrn.mjTRN_SITE,
            target=target,
            refsite=reference,
        )
        own = parameters.of_kind(AxisGains, _AXES[axis]) or translation
        servo.set_to_position(kp=own.kp, kv=own.kv)
        servo.gear = [float(axis == other) for other in range(6)]
    own = parameters.of_kind(AxisGains, "orientation") or orientation
    if has_goal_sites:
        spec.body(reference).add_site(name=f"{agent}/goal")
        for axis in range(3, 6):
            servo = spec.add_actuator(
                name=f"{agent}/about_{_AXES[axis - 3]}",
                trntype=mujoco.mjtTrn.mjTRN_SITE,
                target=target,
                refsite=f"{agent}/goal",
            )
            servo.set_to_position(kp=own.kp, kv=own.kv)
            servo.gear = [float(axis == other) for other in range(6)]
        return
    servo = spec.add_actuator(
        name=f"{agent}/orientation",
        trntype=mujoco.mjtTrn.mjTRN_SITE,
        target=target,
        refsite=reference,
    )
    chart = mujoco.mjtCtrlChart.mjCHART_QUAT
    servo.set_to_orientation(kp=own.kp, kv=own.kv, ctrlspec=chart)


def _add_sensors(spec: mujoco.MjSpec, agent: str) -> None:
    """Add the agent's 20 numbers, in the order of ``FencingBatch.sensors``."""
    kind, site = mujoco.mjtSensor, mujoco.mjtObj.mjOBJ_SITE
    in_world = {
        "position": kind.mjSENS_FRAMEPOS,
        "quaternion": kind.mjSENS_FRAMEQUAT,
        "linear_velocity": kind.mjSENS_FRAMELINVEL,
        "angular_velocity": kind.mjSENS_FRAMEANGVEL,
    }
    for name, sensor in in_world.items():
        spec.add_sensor(
            name=f"{agent}/bat/{name}", type=sensor, objtype=site, objname=f"{agent}/bat"
        )
    for name in ("position", "quaternion"):
        spec.add_sensor(
            name=f"{agent}/tool/{name}",
            type=in_world[name],
            objtype=site,
            objname=f"{agent}/tool",
            reftype=site,
            refname=f"{agent}/torso",
        )


def _add_contacts(spec: mujoco.MjSpec, cfg: SimConfig) -> None:
    first, second = AGENTS
    pairs = [(f"{first}/bat", f"{second}/bat")]
    if cfg.bat_arm_contacts:
        pairs += [
            (f"{striker}/bat", f"{struck}/{link}")
            for striker, struck in ((first, second), (second, first))
            for link in _STRUCK
        ]
    for one, other in pairs:
        spec.add_pair(name=f"{one} {other}", geomname1=one, geomname2=other, condim=3)
