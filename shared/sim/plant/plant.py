"""A robot arm as MJCF: joints by name, a command per actuator, and where a tracker sits.

Built of a PR2's arm with its bat, or of any MJCF file whose logged joints are hinges or slides.
Contacts are off: what touches an arm is looked for as an effect, not modelled.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import mujoco
import numpy as np

from shared.errors import IdentificationError
from shared.sim.build import AGENTS, build_spec
from shared.sim.config import SimConfig
from shared.sim.parameters import CommandParameters, load_parameters

Control = Literal["pose", "position", "torque"]
EncoderSide = Literal["motor", "link"]
Model = mujoco.MjModel
"""For those who pass one on and do not look into it."""
TOOL = "riposte/tool"
"""Prefix of the sensors that say where the tracked site is."""
BALANCE = "riposte/centred"
"""Body at the tool under a pose controller, without mass until damping is centred."""
_AGENT = AGENTS[1]
_JOINTS = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
_OFF = mujoco.mjtDisableBit
_ALONE = int(_OFF.mjDSBL_CONTACT) | int(_OFF.mjDSBL_AUTORESET) | int(_OFF.mjDSBL_ISLAND)
"""Nothing touches one arm, and looking for that, or for islands of it, is a quarter of a step."""
PR2_TIMESTEP = 0.00125
"""Of identification, where training takes 10 ms (s). At 2.5 ms centrifugal torques are late by as
much as small causes do, and a link in a gap stays at its flanks for 5 ms too long."""
_FAR_MORE = 10.0
"""Times a limit that nothing reaches then."""
_PR2_ROUGH = 2.0
"""Steps in one that does for differences."""


@dataclass(frozen=True)
class Plant:
    """What a simulation of one arm is made of; build one with :func:`pr2` or :func:`mjcf`."""

    make: Callable[[], mujoco.MjSpec]
    """Returns the arm anew, uncompiled, for somebody to change."""
    control: Control
    joints: tuple[str, ...]
    """In the MJCF, in the order of the logged ones."""
    labels: tuple[str, ...]
    """What the log calls them."""
    actuators: tuple[str, ...]
    """In the MJCF, in the order of the command's columns; four for a pose."""
    timestep: float
    """(s)."""
    base_body: str
    """What the arm stands on."""
    tool_body: str
    """What the tracker and the payload are fixed to."""
    command: CommandParameters = field(default_factory=CommandParameters)
    """What is known to lie between a command and the controller."""
    encoders: EncoderSide = "motor"
    """Which side of a joint's gear its logged position is of; servos go by the motor's."""
    unlimited: tuple[str, ...] = ()
    """Logged joints whose drives give far more than the model file says."""
    rough_timestep: float | None = None
    """A longer step that does for what a change of the arm changes (s); None if there is none."""

    def mj_joint(self, label: str) -> str:
        """Return the MJCF's name of a logged joint."""
        return self.joints[self.labels.index(label)]


def pr2(
    arm: Literal["right", "left"], parameters: Path | None, timestep: float = PR2_TIMESTEP
) -> Plant:
    """Return one arm of a PR2 with its bat, under its Jacobian-transpose pose controller.

    Args:
        arm: which.
        parameters: a ``model.toml``; None is the nominal model.
        timestep: of the physics (s).

    Raises:
        ConfigError: the model file cannot be used.
    """
    values = load_parameters("nominal" if parameters is None else parameters)
    cfg = SimConfig(physics_timestep=timestep, arms=(arm, arm))

    def make() -> mujoco.MjSpec:
        spec = build_spec(cfg, values, (_AGENT,))
        for sensor in list(spec.sensors):
            spec.delete(sensor)
        spec.option.disableflags |= _ALONE
        _track(spec, mujoco.mjtObj.mjOBJ_SITE, f"{_AGENT}/tool", f"{_AGENT}/torso")
        tool = spec.site(f"{_AGENT}/tool")
        tool.parent.add_body(name=BALANCE, pos=tool.pos)
        return spec

    labels = tuple(values.joints.__struct_fields__)
    return Plant(
        make=make,
        control="pose",
        joints=tuple(f"{_AGENT}/{name}" for name in labels),
        labels=labels,
        actuators=tuple(f"{_AGENT}/{name}" for name in ("x", "y", "z", "orientation")),
        timestep=timestep,
        base_body=f"{_AGENT}/torso",
        tool_body=f"{_AGENT}/wrist_roll",
        command=values.command,
        rough_timestep=_PR2_ROUGH * timestep,
    )


def is_weightless(model: mujoco.MjModel) -> bool:
    """Return whether gravity moves nothing of an arm."""
    off = int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
    return bool(model.opt.disableflags & off) or not model.opt.gravity.any()


def mjcf(
    path: Path,
    control: Control,
    joints: Sequence[str],
    actuators: Sequence[str],
    tracked: str,
    encoders: EncoderSide = "motor",
) -> Plant:
    """Return the arm of an MJCF file.

    Args:
        path: the file.
        control: what the command's columns are.
        joints: the logged ones.
        actuators: the command's columns, each the name of an actuator or of a joint.
        tracked: site or body that a tracker is fixed to; empty: the last joint's body.
        encoders: which side of the joints' gears was logged.

    Raises:
        IdentificationError: the file cannot be used, or does not have what the log names.
    """
    text = _read(path)

    def read() -> mujoco.MjSpec:
        kind: Any = mujoco.MjSpec  # its stub lacks the two
        return kind.from_string(text) if text else kind.from_file(str(path))

    try:
        spec = read()
        compiled = spec.compile()
    except ValueError as error:
        raise IdentificationError(f"MuJoCo refused {path}: {error}") from None
    known = {compiled.joint(index).name: index for index in range(compiled.njnt)}
    for name in joints:
        if name not in known:
            raise IdentificationError(
                f"{path} has no joint {name!r}, which the log has; it has: {', '.join(known)}"
            )
    for name, index in known.items():
        if int(compiled.jnt_type[index]) not in _JOINTS:
            raise IdentificationError(
                f"{path}: joint {name!r} is no hinge or slide: an arm stands still and has nothing "
                "loose, so take it out of the MJCF"
            )
    if missing := [name for name in known if name not in joints]:
        raise IdentificationError(
            f"{path} has joints of which the log has no column (q_{', q_'.join(missing)}): "
            "log every joint, or take it out of the MJCF"
        )
    drives = _drives(compiled, control, joints, actuators, path)
    last = compiled.jnt_bodyid[known[joints[-1]]]
    site_names = [compiled.site(index).name for index in range(compiled.nsite)]
    body_names = [compiled.body(index).name for index in range(compiled.nbody)]
    if tracked and tracked not in site_names and tracked not in body_names:
        raise IdentificationError(f"{path} has no site or body {tracked!r} for the tracker")
    names = _Names(spec, compiled)
    tool = names.body(
        int(compiled.site(tracked).bodyid[0]) if tracked in site_names
        else compiled.body(tracked).id if tracked else int(last)
    )  # fmt: skip
    kind = mujoco.mjtObj.mjOBJ_SITE if tracked in site_names else mujoco.mjtObj.mjOBJ_XBODY

    def make() -> mujoco.MjSpec:
        spec = read()
        for index, body in enumerate(spec.bodies):
            if not body.name:
                body.name = f"body {index}"
        for sensor in list(spec.sensors):
            spec.delete(sensor)
        for key in list(spec.keys):
            spec.delete(key)
        if drives.own:
            for actuator in list(spec.actuators):
                spec.delete(actuator)
            for name in joints:
                motor = spec.add_actuator(name=name, target=name)
                motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
                motor.set_to_motor()
        spec.option.disableflags |= _ALONE
        spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        _track(spec, kind, tracked or tool, "")
        return spec

    return Plant(
        make=make,
        control=control,
        joints=tuple(joints),
        labels=tuple(joints),
        actuators=drives.names,
        timestep=float(compiled.opt.timestep),
        base_body=names.body(_root(compiled, int(last))),
        tool_body=tool,
        encoders=encoders,
    )


def stepped(plant: Plant, timestep: float) -> Plant:
    """Return the same arm with another time step of its physics (s).

    If it is a shorter one, the arm's own does for what a change changes.
    """

    def make() -> mujoco.MjSpec:
        spec = plant.make()
        spec.option.timestep = timestep
        return spec

    rough = plant.timestep if timestep < plant.timestep else None
    return replace(plant, make=make, timestep=timestep, rough_timestep=rough)


def unlimited(plant: Plant, joints: Sequence[str]) -> Plant:
    """Return the same arm with drives of some logged joints that give far more than its file says.

    Args:
        plant: the arm.
        joints: what the log calls them.
    """
    found = replace(plant, unlimited=tuple(joints))

    def make() -> mujoco.MjSpec:
        spec = plant.make()
        lift_limits(spec, found)
        return spec

    return replace(found, make=make)


def lift_limits(spec: mujoco.MjSpec, plant: Plant) -> None:
    """Let drives in a model file give far more, at the joints where a plant's do."""
    names = {plant.mj_joint(label) for label in plant.unlimited}
    for actuator in spec.actuators:
        if actuator.trntype == mujoco.mjtTrn.mjTRN_JOINT and actuator.target in names:
            actuator.forcerange = _FAR_MORE * np.array(actuator.forcerange)
    for name in names:
        joint = spec.joint(name)
        joint.actfrcrange = _FAR_MORE * np.array(joint.actfrcrange)


@dataclass(frozen=True)
class _Drives:
    names: tuple[str, ...]
    own: bool
    """Whether the file's actuators give way to one motor a joint."""


class _Names:
    """Names of an MJCF's bodies, made up where it has none."""

    def __init__(self, spec: mujoco.MjSpec, compiled: mujoco.MjModel) -> None:
        self._given = [compiled.body(index).name for index in range(compiled.nbody)]
        self._count = len(list(spec.bodies))

    def body(self, index: int) -> str:
        return self._given[index] or f"body {index}"


def _read(path: Path) -> str:
    """Return the MJCF's text, empty where it refers to other files and is read from its place."""
    try:
        text = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise IdentificationError(f"cannot read the MJCF {path}: {reason}") from None
    return "" if any(word in text for word in ("file=", "<include", "meshdir")) else text


def _drives(
    compiled: mujoco.MjModel,
    control: Control,
    joints: Sequence[str],
    columns: Sequence[str],
    path: Path,
) -> _Drives:
    """Return which actuator each column of the command drives."""
    if control == "pose":
        raise IdentificationError('control = "pose" needs [model] kind = "pr2"')
    names = [compiled.actuator(index).name for index in range(compiled.nu)]
    targets: dict[str, str] = {}
    for index in range(compiled.nu):
        if compiled.actuator_trntype[index] == mujoco.mjtTrn.mjTRN_JOINT:
            joint = compiled.joint(int(compiled.actuator_trnid[index, 0])).name
            targets[joint] = names[index]
    is_servo = compiled.actuator_biastype[:] == mujoco.mjtBias.mjBIAS_AFFINE
    has_position = all(is_servo)
    found = [name if name in names else targets.get(name, "") for name in columns]
    if control == "torque" and (not compiled.nu or has_position):
        if sorted(columns) != sorted(joints):
            raise IdentificationError(
                f"{path} has no motors, so command.parquet needs a column for each joint "
                f"({', '.join(joints)}); it has {', '.join(columns)}"
            )
        return _Drives(tuple(columns), own=True)
    if not all(found) or len(set(found)) < len(found):
        lost = [name for name, match in zip(columns, found, strict=True) if not match]
        raise IdentificationError(
            f"{path} has no actuator for the command's column {', '.join(lost) or columns}; "
            f"it has: {', '.join(names) or 'none'}"
        )
    servos = [name for name in found if is_servo[compiled.actuator(name).id]]
    if control == "torque" and servos:
        raise IdentificationError(
            f'{path}: control = "torque", but there are servos ({", ".join(servos)}), which are '
            "told no torque: give these joints motors, and their columns the torque that they got"
        )
    if control == "position" and not has_position:
        raise IdentificationError(
            f'{path}: control = "position" needs position actuators, this one has motors'
        )
    return _Drives(tuple(found), own=False)


def _root(compiled: mujoco.MjModel, body: int) -> int:
    """Return the first body below the world that carries a body."""
    while compiled.body_parentid[body]:
        body = int(compiled.body_parentid[body])
    return body


def _track(spec: mujoco.MjSpec, kind: mujoco.mjtObj, name: str, frame: str) -> None:
    """Add sensors of a pose, in a site's frame or in the world's."""
    for part, sensor in (
        ("position", mujoco.mjtSensor.mjSENS_FRAMEPOS),
        ("quaternion", mujoco.mjtSensor.mjSENS_FRAMEQUAT),
    ):
        made = spec.add_sensor(name=f"{TOOL}/{part}", type=sensor, objtype=kind, objname=name)
        if frame:
            made.reftype, made.refname = mujoco.mjtObj.mjOBJ_SITE, frame
