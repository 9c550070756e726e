"""One arm of a batch, as an effect gets it to change: its model, its command, its reports."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import Plant
from shared.sim.plant.signals import Signal
from shared.sim.plant.step import Step
from shared.sim.plant.structure import STIFF, armature_for


class TorqueLaw(Protocol):
    """A torque that depends on what the arm does; stateless but for its memory."""

    memory: int
    """Numbers that it keeps for each arm from step to step, 0 at the start."""

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        """Return float64[K, J] to be added at the joints (N m, N).

        Args:
            step: the state.
            values: float64[K, P], what the effect gave to :meth:`Row.torque`.
            memory: float64[K, M], to be changed in place.
        """
        ...


class FrictionLaw(Protocol):
    """Coulomb friction that depends on what the arm does; the solver lets it stick."""

    def __call__(self, step: Step, values: Float64) -> Float64:
        """Return float64[K, J], to be added to the joints' friction, which is at least 0 (N m, N).

        Args:
            step: the state.
            values: float64[K, P], what the effect gave to :meth:`Row.friction`.
        """
        ...


@dataclass(frozen=True)
class Friction:
    """A friction law at work in an arm."""

    law: FrictionLaw
    values: Float64
    """float64[P]."""
    ways: Float64
    """float64[J], over what way it turns round at each joint (rad, m); 0 is at once."""


@dataclass
class JointsReport:
    """What the robot would log."""

    at: Float64
    """float64[T] (s)."""
    q: Float64
    """float64[T, J]."""


@dataclass
class TrackerReport:
    """What a tracker would log."""

    at: Float64
    """float64[K] on the tracker's clock (s)."""
    pose: Float64
    """float64[K, 7] in the base frame."""


Rest = Callable[[float], float]
"""Turns the torque that an added joint has to hold (N m, N) into its position (rad, m).

Arms whose joints' are equal, and all else, move alike and are simulated once: a plain function
equals itself alone.
"""


@dataclass(frozen=True)
class Sprung:
    """Where a spring holds."""

    stiffness: float
    """(N m/rad, N/m)."""

    def __call__(self, load: float) -> float:
        """Return the position (rad, m)."""
        return -load / self.stiffness


@dataclass(frozen=True)
class At:
    """One position, whatever the load."""

    place: float
    """(rad, m)."""

    def __call__(self, load: float) -> float:
        """Return the position (rad, m)."""
        return self.place


@dataclass(frozen=True)
class Encoders:
    """What encoders say of joints q: ``scale * q + offset``."""

    scale: Float64
    """float64[J]; 1 is right."""
    offset: Float64
    """float64[J]; 0 is right (rad, m)."""


@dataclass
class Row:
    """One arm that replays one trajectory."""

    plant: Plant
    model: mujoco.MjModel
    """Of the batch: names, sizes and nominal values; never changed."""
    index: int
    """In the batch, from when it is in one."""
    dofs: np.ndarray
    """int[J], where the velocities of the logged joints are in the model."""
    command: Signal
    """Replace it to change what reaches the controller; instants are the log's (s)."""
    logged_q: Signal
    """What the robot logged, for effects on how commands were understood."""
    logged_tracker: Signal | None
    """What a tracker logged, poses by its own clock; None without one."""
    duration: float
    """(s)."""
    trajectory: str
    """Name of the recording."""
    begin: float
    """How far into the recording time 0 is (s)."""
    earlier: tuple[str, ...]
    """Names of the recordings made before it."""
    initial_q: Float64
    """float64[J], where the joints are at time 0 (rad, m); not to be changed in place."""
    initial_qd: Float64
    """float64[J] (rad/s, m/s)."""
    tracker_time: Callable[[Float64], Float64] | None = None
    """Turns instants of the tracker's clock into true ones, if it is not right."""
    joints_reports: list[Callable[[JointsReport], None]] = dataclasses.field(
        default_factory=list[Callable[[JointsReport], None]]
    )
    tracker_reports: list[Callable[[TrackerReport], None]] = dataclasses.field(
        default_factory=list[Callable[[TrackerReport], None]]
    )
    laws: list[tuple[TorqueLaw, Float64]] = dataclasses.field(
        default_factory=list[tuple[TorqueLaw, Float64]]
    )
    frictions: list[Friction] = dataclasses.field(default_factory=list[Friction])
    rests: dict[str, Rest] = dataclasses.field(default_factory=dict[str, Rest])
    speeds: dict[str, float] = dataclasses.field(default_factory=dict[str, float])
    """Of added joints at time 0 (rad/s); 0 of the others."""
    encoders: Encoders | None = None
    """What a pose controller knows the arm by; None where they are right, and their joints all
    there are."""
    forces: dict[int, tuple[float, float, float]] = dataclasses.field(
        default_factory=dict[int, tuple[float, float, float]]
    )
    """What pulls at the centre of mass of a body besides (N, in the world): weight that nothing
    balances on an arm that is weightless otherwise, or that is balanced the wrong way."""
    fields: dict[str, Float64] = dataclasses.field(default_factory=dict[str, Float64])

    @property
    def has_laws(self) -> bool:
        """Return whether something has to be asked at each step what it does to the arm."""
        return bool(self.laws or self.frictions or self.encoders)

    def field(self, name: str) -> Float64:
        """Return a field of this arm's own model, to be changed in place."""
        if name not in self.fields:
            owner = self.model.opt if name.startswith("opt.") else self.model
            self.fields[name] = np.array(getattr(owner, name.removeprefix("opt.")), np.float64)
        return self.fields[name]

    def current(self, name: str) -> Float64:
        """Return a field as it is by now, not to be changed."""
        return self.fields[name] if name in self.fields else getattr(self.model, name)

    def dof(self, label: str) -> int:
        """Return the index of a logged joint's velocity in the model."""
        return int(self.dofs[self.plant.labels.index(label)])

    def mj_joint(self, name: str) -> int:
        """Return the index of a joint of the MJCF, added ones included."""
        return int(self.model.joint(name).id)

    def body_of(self, label: str) -> int:
        """Return the index of the body that a logged joint carries."""
        return int(self.model.jnt_bodyid[self.mj_joint(self.plant.mj_joint(label))])

    def tool_body(self) -> int:
        """Return the index of the body that the tracker is fixed to."""
        return int(self.model.body(self.plant.tool_body).id)

    def actuator(self, index: int) -> int:
        """Return the model's index of the actuator behind a column of the command."""
        return int(self.model.actuator(self.plant.actuators[index]).id)

    def drives_of(self, label: str) -> list[int]:
        """Return the actuators that act on one logged joint alone; none for a pose."""
        return drives_of(self.plant, self.model, label)

    def spring(self, name: str, compliance: float, ringing: float) -> None:
        """Let an added joint give.

        Args:
            name: in the MJCF.
            compliance: rad/(N m); 0 does not give.
            ringing: damping as a share of the square root of the stiffness (sqrt(kg) m).
        """
        joint = self.mj_joint(name)
        dof = int(self.model.jnt_dofadr[joint])
        stiffness = min(1.0 / max(compliance, 1e-12), STIFF)
        self.rest(name, Sprung(stiffness))
        self.field("jnt_stiffness")[joint] = stiffness
        # The second part stills what the armature below would let ring, and is over in a step.
        self.field("dof_damping")[dof] = (
            ringing * stiffness**0.5 + 0.4 * stiffness * self.plant.timestep
        )
        self.field("dof_armature")[dof] = armature_for(stiffness, self.plant.timestep)

    def rest(self, name: str, rests: Rest) -> None:
        """Let an added joint start where its load leaves it.

        Args:
            name: in the MJCF.
            rests: where that is.
        """
        self.rests[name] = rests

    def start(self, name: str, place: float, speed: float) -> None:
        """Let an added joint start anywhere.

        Args:
            name: in the MJCF.
            place: (rad, m).
            speed: (rad/s, m/s).
        """
        self.rests[name] = At(place)
        self.speeds[name] = speed

    def trust_encoders(self) -> None:
        """Let a pose controller know the arm by its encoders alone: it sees no added joint."""
        if self.plant.control == "pose" and self.encoders is None:
            count = len(self.plant.labels)
            self.encoders = Encoders(np.ones(count), np.zeros(count))

    def misread(self, joint: int, scale: float, offset: float) -> None:
        """Let the encoder of a logged joint, by its index, say another angle to pose controllers.

        Args:
            joint: index of the logged joint.
            scale: what it says is ``scale`` times what it said,
            offset: and so much more (rad, m).
        """
        self.trust_encoders()
        if self.encoders is not None:
            scales, offsets = self.encoders.scale.copy(), self.encoders.offset.copy()
            scales[joint] *= scale
            offsets[joint] = scale * offsets[joint] + offset
            self.encoders = Encoders(scales, offsets)

    def torque(self, law: TorqueLaw, values: Float64) -> None:
        """Let a law act on this arm: float64[P] are its parameters."""
        self.laws.append((law, np.asarray(values, np.float64)))

    def friction(self, law: FrictionLaw, values: Float64, ways: Float64) -> None:
        """Let joints of this arm rub by a law.

        Args:
            law: how much.
            values: float64[P], its parameters.
            ways: float64[J], over what way it turns round at each joint (rad, m); 0 is at once.
        """
        self.field("dof_frictionloss")
        if ways.any():
            self.field("dof_damping")
        self.frictions.append(Friction(law, values, ways))

    def on_joints(self, change: Callable[[JointsReport], None]) -> None:
        """Change what the robot logs of its joints."""
        self.joints_reports.append(change)

    def on_tracker(self, change: Callable[[TrackerReport], None]) -> None:
        """Change what the tracker logs."""
        self.tracker_reports.append(change)

    def warp_tracker(self, change: Callable[[Float64], Float64]) -> None:
        """Turn instants of the tracker's clock into true ones, on top of what others turn."""
        before = self.tracker_time
        self.tracker_time = change if before is None else lambda at: change(before(at))


def drives_of(plant: Plant, model: mujoco.MjModel, label: str) -> list[int]:
    """Return the actuators of a model that act on one logged joint alone; none for a pose."""
    joint = int(model.joint(plant.mj_joint(label)).id)
    return [
        index
        for index, kind in enumerate(model.actuator_trntype)
        if kind == mujoco.mjtTrn.mjTRN_JOINT and model.actuator_trnid[index, 0] == joint
    ]
