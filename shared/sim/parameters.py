"""The simulator's parameters: what identification may change, as a ``model.toml``.

Everything that is geometry of the PR2 stays in ``data/pr2_arm.toml``; everything that a
recording could correct is here. The structs are frozen; a changed model is a new struct.
"""

import math
import re
from pathlib import Path
from typing import Final, Literal, TypeVar, get_args

import msgspec
import tomli_w

from shared.config import toml
from shared.errors import ConfigError
from shared.sim.config import JointName

SCHEMA: Final = 1
"""Version of ``model.toml`` this build reads and writes."""

JOINT_NAMES: Final[tuple[JointName, ...]] = get_args(JointName)
"""The seven joints of an arm, from the torso to the gripper."""

Axis = Literal["x", "y", "z", "orientation"]
"""A direction of the servo; its frame is the torso's."""
Kind = TypeVar("Kind", bound="Extension")

_DATA: Final = Path(__file__).parent / "data"


class _Section(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of every table of ``model.toml``: frozen, unknown keys fatal."""


def _within(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:  # also refuses NaN
        raise ValueError(f"{name} must be between {low:g} and {high:g}, got {value:g}")


class JointParameters(_Section, frozen=True):
    """One joint, the same on both robots."""

    damping: tuple[float, float, float]
    """Polynomial a v + b v|v| + c v^3 (N m s/rad, N m s^2/rad^2, N m s^3/rad^3)."""
    friction_loss: float
    """Coulomb friction (N m)."""
    armature: float
    """Reflected rotor inertia (kg m^2)."""
    torque_limit: float
    """Largest torque of the servo at this joint (N m)."""

    def __post_init__(self) -> None:
        _within("damping[0]", self.damping[0], 0.0, 1e3)
        _within("damping[1]", self.damping[1], -1e3, 1e3)
        _within("damping[2]", self.damping[2], 0.0, 1e3)
        _within("friction_loss", self.friction_loss, 0.0, 100.0)
        _within("armature", self.armature, 0.0, 10.0)
        _within("torque_limit", self.torque_limit, 1e-3, 1e3)


class ArmParameters(_Section, frozen=True):
    """The seven joints of an arm."""

    shoulder_pan: JointParameters
    shoulder_lift: JointParameters
    upper_arm_roll: JointParameters
    elbow_flex: JointParameters
    forearm_roll: JointParameters
    wrist_flex: JointParameters
    wrist_roll: JointParameters

    def __getitem__(self, name: JointName) -> JointParameters:
        """Return the parameters of the joint called ``name``."""
        joint: JointParameters = getattr(self, name)
        return joint


class Gains(_Section, frozen=True):
    """Gains of a Cartesian servo: N/m and N s/m, or N m/rad and N m s/rad."""

    kp: float
    kv: float

    def __post_init__(self) -> None:
        _within("kp", self.kp, 0.0, 1e5)
        _within("kv", self.kv, 0.0, 1e4)


class ServoParameters(_Section, frozen=True):
    """Jacobian-transpose servo of the tool: torque = J^T (kp error - kv J qvel)."""

    translation: Gains
    orientation: Gains


class CommandParameters(_Section, frozen=True):
    """What lies between a command and the servo."""

    filter: float = 1.0
    """Share of the remaining way that the filtered command moves per 1 ms cycle; 1.0 = off."""
    delay: float = 0.0
    """Transport delay (s)."""

    def __post_init__(self) -> None:
        _within("filter", self.filter, 1e-4, 1.0)
        _within("delay", self.delay, 0.0, 0.5)

    @property
    def is_direct(self) -> bool:
        """Whether a command reaches the servo at once and unchanged."""
        return self.filter == 1.0 and self.delay == 0.0


class BatParameters(_Section, frozen=True):
    """A bat held in the gripper: a capsule, heavy as a solid cylinder."""

    mass: float
    """Mass (kg)."""
    length: float
    """Length of the capsule's axis (m)."""
    radius: float
    """Radius of the capsule (m)."""
    behind_grip: float
    """Part of the axis that lies behind the tool frame (m)."""
    mount_angle: float
    """Angle from the gripper's +x axis to the blade, towards the gripper's +z (rad)."""

    def __post_init__(self) -> None:
        _within("mass", self.mass, 1e-3, 10.0)
        _within("length", self.length, 0.05, 3.0)
        _within("radius", self.radius, 1e-3, 0.2)
        _within("behind_grip", self.behind_grip, 0.0, self.length)
        _within("mount_angle", self.mount_angle, -math.pi, math.pi)


class ResidualSpring(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="residual_spring"
):
    """What a joint's spring counterbalance leaves over: torque = -stiffness (q - angle)."""

    joint: JointName
    stiffness: float
    """N m/rad."""
    angle: float
    """Angle at which nothing is left over (rad)."""

    def __post_init__(self) -> None:
        _within("stiffness", self.stiffness, 0.0, 1e3)
        _within("angle", self.angle, -2 * math.pi, 2 * math.pi)


class TorqueBias(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="torque_bias"
):
    """A constant torque at a joint: an offset of its drive."""

    joint: JointName
    torque: float
    """N m."""

    def __post_init__(self) -> None:
        _within("torque", self.torque, -100.0, 100.0)


class LinkMass(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="link_mass"
):
    """A link that is heavier or lighter than the data sheet says; the last one has the bat."""

    joint: JointName
    """That carries the link."""
    factor: float
    """Of mass and inertia."""

    def __post_init__(self) -> None:
        _within("factor", self.factor, 0.05, 100.0)


class AxisGains(
    msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="axis_gains"
):
    """Gains of one direction of the servo in place of the table's."""

    axis: Axis
    kp: float
    """N/m."""
    kv: float
    """N s/m."""

    def __post_init__(self) -> None:
        _within("kp", self.kp, 0.0, 1e5)
        _within("kv", self.kv, 0.0, 1e4)


Extension = ResidualSpring | TorqueBias | LinkMass | AxisGains
"""Union of the physical effects a model may add to the nominal one, told apart by ``type``."""


class Measured(_Section, frozen=True):
    """A cause on the side of measurement: it changes what is logged, and nothing that moves."""

    effect: str
    """As identification calls it: ``tracker_latency``."""
    where: str
    """Joint; empty: the whole arm, or the tracker."""
    values: dict[str, float]
    """By quantity, SI."""


class ModelParameters(_Section, frozen=True):
    """A whole ``model.toml``."""

    schema: int
    name: str
    """What people call this model."""
    servo: ServoParameters
    command: CommandParameters
    bat: BatParameters
    joints: ArmParameters
    extensions: tuple[Extension, ...] = ()
    """Effects beyond the nominal model; each kind may be given once per joint or axis."""
    measurement: tuple[Measured, ...] = ()
    """What recordings get wrong, for who calibrates sensors; no part of the physics or its hash."""

    def __post_init__(self) -> None:
        if self.schema != SCHEMA:
            raise ValueError(f"schema must be {SCHEMA}, got {self.schema}")
        seen = [(type(each), place_of(each)) for each in self.extensions]
        if len(set(seen)) < len(seen):
            raise ValueError("extensions names one kind twice for the same joint or axis")

    def of_kind(self, kind: type[Kind], place: str) -> Kind | None:
        """Return the extension of one kind at a joint or an axis, None where there is none."""
        for each in self.extensions:
            if isinstance(each, kind) and place_of(each) == place:
                return each
        return None


def place_of(extension: Extension) -> str:
    """Return the joint or the axis that an extension is for."""
    return extension.axis if isinstance(extension, AxisGains) else extension.joint


def load_parameters(source: str | Path) -> ModelParameters:
    """Return the parameters of a shipped model (``"nominal"``) or of a ``model.toml``.

    Raises:
        ConfigError: if the file cannot be read, is not TOML, or has a field that is unknown,
            missing or out of range; one line that names the file and the field.
    """
    path = Path(source)
    if path.suffix != ".toml" and path.name == str(source):
        path = _DATA / f"{source}.toml"
        if not path.is_file() or path.stem == "pr2_arm":
            raise ConfigError(
                f'there is no model called "{source}": use "nominal" or the path of a model.toml'
            )
    try:
        return toml.decode(path.read_bytes(), ModelParameters)
    except OSError as error:
        raise ConfigError(f"cannot read the model {path}: {error.strerror}") from error
    except msgspec.ValidationError as error:
        raise ConfigError(f"{path}: {_readable(str(error))}") from error
    except ValueError as error:
        raise ConfigError(f"{path} is not TOML: {error}") from error


def dump_parameters(parameters: ModelParameters) -> str:
    """Return ``parameters`` as the text of a ``model.toml``."""
    tables = msgspec.to_builtins(parameters, builtin_types=())
    return tomli_w.dumps({key: value for key, value in tables.items() if value != []})


def _readable(message: str) -> str:
    """Return a msgspec message with the field first: ``joints.elbow_flex.armature: ...``."""
    match = re.fullmatch(r"(?P<what>.*) - at `\$\.?(?P<where>[^`]*)`", message, re.DOTALL)
    if match is None:
        return message
    return f"{match['where'] or 'top level'}: {match['what']}"
