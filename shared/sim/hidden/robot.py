"""One robot that is not quite what its model says, as its recordings see it."""

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mujoco
import mujoco.rollout
import numpy as np

from shared.errors import SimulationError
from shared.sim.arm import Float64
from shared.sim.hidden.controller import Controller, controller_of
from shared.sim.model import silence
from shared.sim.plant.plant import TOOL, Plant
from shared.sim.plant.signals import Signal, sampled, sampled_poses

SETTLE = 1.5
"""How long it holds its first command before a recording begins (s)."""
_BRAKE = 10.0
"""Damping that brings it to rest in that time, per effective inertia (1/s)."""
_roll: Any = mujoco.rollout.rollout
_STICKS = (0.9995, 0.9999)
"""Impedance of dry friction: with MuJoCo's own 0.9 a joint creeps that should stick."""


@dataclass
class Moment:
    """One step, once positions, velocities and what follows from them are known."""

    model: mujoco.MjModel
    """Of this recording alone: may be changed."""
    data: mujoco.MjData
    """``qfrc_applied`` and ``xfrc_applied`` may be added to."""
    trajectory: str
    """Name of the recording."""
    timestep: float
    """(s)."""
    dofs: np.ndarray
    """int64[J], of the logged joints."""
    usual_damping: Float64
    """float64[V], of every joint once it has settled (N m s/rad)."""
    time: float
    """Since the recording began (s); negative while it settles."""
    drive: Float64
    """float64[J], what the drives put on the logged joints (N m); may be replaced."""


Law = Callable[[Moment], None]
Hold = Callable[[float, Signal], Float64]


@dataclass(frozen=True)
class Played:
    """What it did, at the instants that were asked for, without any noise."""

    q: Float64
    """float64[T, J], as its encoders say."""
    tracker: Float64 | None
    """float64[K, 7]."""


class Robot:
    """A robot to be changed through its attributes, then played any number of times."""

    def __init__(self, plant: Plant, timestep: float) -> None:
        """Begin with the arm as its model has it.

        Args:
            plant: the arm.
            timestep: of its physics (s).
        """
        silence()
        self.plant = plant
        self.timestep = timestep
        self.spec = plant.make()
        self.spec.option.timestep = timestep
        self.commands: list[Callable[[Signal], Signal]] = []
        """Change the stream of commands on its way."""
        self.hold: Callable[[], Hold] | None = None
        """Make what the controller takes of a command in a step that begins at an instant (s)."""
        self.leads: list[Callable[[], Hold]] = []
        """Make what it adds to that."""
        self.drives: list[Callable[[], Law]] = []
        """Make what changes the drive's torques; called anew for each recording, as ``laws``."""
        self.laws: list[Callable[[], Law]] = []
        """Make what else acts on the arm."""
        self.joints: list[Callable[[Float64, Float64], Float64]] = []
        """Change what the encoders say: float64[T] (s), float64[T, J]."""
        self.trackers: list[Callable[[str, Float64, Float64], Float64]] = []
        """Change what the tracker says: recording, float64[K] true time (s), float64[K, 7]."""
        self.tracker_clocks: list[Callable[[Float64], Float64]] = []
        """Turn the true time at which the tracker looked into what it writes (s)."""
        self.scale = np.ones(len(plant.labels))
        self.offset = np.zeros(len(plant.labels))
        """float64[J]: encoders say ``scale * q + offset`` (rad)."""
        self.outages: list[tuple[float, float]] = []
        """From when to when no reading of the joints arrives in any recording (s)."""
        self.has_controller = False
        """Whether a controller beside the arm knows it by its encoders alone; slower."""
        self._model: mujoco.MjModel | None = None

    def joint(self, label: str) -> mujoco.MjSpec:
        """Return a logged joint of the uncompiled arm."""
        return self.spec.joint(self.plant.mj_joint(label))

    def trust_encoders(self) -> None:
        """Let the pose controller know the arm by its encoders alone, as a real one does."""
        self.has_controller = self.has_controller or self.plant.control == "pose"

    def drive_apart(self) -> None:
        """Let drives get their torques from a controller beside the arm.

        MuJoCo's implicit step counts on the damping of its own servos, also where a drive that is
        limited or weak does not give it: an arm that is as sluggish as if it did.
        """
        self.has_controller = self.plant.control != "torque"

    def misread(self, label: str, scale: float, offset: float) -> None:
        """Let an encoder say ``scale * q + offset`` (rad), to the controller as to the log."""
        index = self.plant.labels.index(label)
        self.scale[index] *= scale
        self.offset[index] = scale * self.offset[index] + offset
        self.drive_apart()

    @property
    def model(self) -> mujoco.MjModel:
        """Return the compiled arm; from then on only what acts at run time can be changed."""
        if self._model is None:
            model: mujoco.MjModel = self.spec.compile()
            model.dof_solimp[:, :2] = _STICKS
            self._model = model
        return self._model

    def stamp(self, at: Float64) -> Float64:
        """Return what the tracker writes for true instants (s)."""
        for clock in self.tracker_clocks:
            at = clock(at)
        return at

    def play(
        self,
        command: Signal,
        rest: Float64,
        duration: float,
        joints_at: Float64,
        tracker_at: Float64 | None,
        disturbance: Float64 | None = None,
        name: str = "",
    ) -> Played:
        """Settle at the first command, then follow the others.

        Args:
            command: from time 0 on.
            rest: float64[J], where it is put before it settles (rad).
            duration: (s).
            joints_at: float64[T] (s).
            tracker_at: float64[K], true instants (s); None without a tracker.
            disturbance: float64[S, J], torque on the joints at each step of the recording (N m).
            name: of the recording.

        Raises:
            SimulationError: the physics diverged.
        """
        for change in self.commands:
            command = change(command)
        settling = round(SETTLE / self.timestep)
        steps = settling + int(np.ceil(duration / self.timestep)) + 1
        times: Float64 = self.timestep * (np.arange(steps, dtype=np.float64) - settling)
        pushes = np.zeros((steps, len(rest)))
        if disturbance is not None:
            pushes[settling:] = disturbance[: steps - settling]
        q, seen = self._simulate(name, command, rest, times, pushes)
        after = times[settling:]
        encoders = self.scale * sampled(after, q[settling:], joints_at) + self.offset
        for look in self.joints:
            encoders = look(joints_at, encoders)
        poses = None
        if tracker_at is not None:
            poses = sampled_poses(after, seen[settling:], tracker_at)
            for look in self.trackers:
                poses = look(name, tracker_at, poses)
        return Played(encoders, poses)

    def _simulate(
        self, name: str, command: Signal, rest: Float64, times: Float64, pushes: Float64
    ) -> tuple[Float64, Float64]:
        """Return float64[S, J] joints and float64[S, 7] tool, as they are."""
        model = copy.copy(self.model)
        data = mujoco.MjData(model)
        qpos = np.array([int(model.joint(name).qposadr[0]) for name in self.plant.joints])
        dofs = np.array([int(model.joint(name).dofadr[0]) for name in self.plant.joints])
        controller = None
        if self.has_controller:
            controller = controller_of(self.plant, model)
            command = command.later(float(model.actuator_delay[0]))
        # A step's drive acts from half a step before it to half a step after it (Stormer and
        # Verlet's method, which MuJoCo's is); else the arm would be early by half of one.
        begins = times - 0.5 * self.timestep
        if self.hold is None:
            ctrl = command.mean(begins, self.timestep)
        else:
            hold = self.hold()
            ctrl = np.stack([hold(begin, command) for begin in begins.tolist()])
        for make in self.leads:
            lead = make()
            ctrl = ctrl + np.stack([lead(begin, command) for begin in begins.tolist()])
        drives, laws = [make() for make in self.drives], [make() for make in self.laws]
        _begin(model, data, qpos, (rest - self.offset) / self.scale, ctrl[0])
        moment = Moment(
            model, data, name, self.timestep, dofs, model.dof_damping.copy(), 0.0,
            np.zeros(len(dofs)),
        )  # fmt: skip
        settling = int(np.searchsorted(times, -0.5 * self.timestep))
        model.dof_damping[:] += _BRAKE * model.dof_M0
        parts: list[tuple[Float64, Float64]] = []
        for part in (slice(0, settling), slice(settling, len(times))):
            if controller is None and not (drives or laws):
                parts.append(_rolled(model, data, qpos, dofs, ctrl[part], pushes[part]))
            else:
                act = _Act(self, moment, controller, drives, laws)
                parts.append(_stepped(act, qpos, times[part], ctrl[part], pushes[part]))
            model.dof_damping[:] = moment.usual_damping
            data.qvel[:] = 0.0
        q, seen = (np.concatenate(both) for both in zip(*parts, strict=True))
        if not np.isfinite(q).all() or data.warning.number.any():
            raise SimulationError(f"the {self.plant.control}-controlled arm diverged")
        return q, seen


@dataclass
class _Act:
    """What acts at each step beyond the simulator's own servos."""

    robot: Robot
    moment: Moment
    controller: Controller | None
    drives: list[Law]
    laws: list[Law]

    def __call__(self, wanted: Float64, q: Float64) -> None:
        """Add what the drives and everything else do, for a command and the joints as they are."""
        moment, data, robot = self.moment, self.moment.data, self.robot
        if self.controller is None:
            mujoco.mj_fwdActuation(moment.model, data)
            before = data.qfrc_actuator[moment.dofs].copy()
            moment.drive = before.copy()
        else:
            said = robot.scale * q + robot.offset
            speed = robot.scale * data.qvel[moment.dofs]
            moment.drive = self.controller.torques(wanted, said, speed)
            before = np.zeros(len(q))
        for drive in self.drives:
            drive(moment)
        data.qfrc_applied[moment.dofs] += moment.drive - before
        for law in self.laws:
            law(moment)


def _stepped(
    act: _Act, qpos: np.ndarray, times: Float64, ctrl: Float64, pushes: Float64
) -> tuple[Float64, Float64]:
    """Go step by step; return float64[S, J] joints and float64[S, 7] tool before each step."""
    moment = act.moment
    model, data = moment.model, moment.data
    tool = int(model.sensor(f"{TOOL}/position").adr[0])
    q, seen = np.empty((len(times), len(qpos))), np.empty((len(times), 7))
    for step, time in enumerate(times.tolist()):
        wanted = ctrl[step]
        data.ctrl[: len(wanted)] = wanted
        data.qfrc_applied[:] = 0.0
        data.xfrc_applied[:] = 0.0
        data.qfrc_applied[moment.dofs] = pushes[step]
        mujoco.mj_step1(model, data)
        q[step] = data.qpos[qpos]
        seen[step] = data.sensordata[tool : tool + 7]
        moment.time = time
        act(wanted, q[step])
        mujoco.mj_step2(model, data)
    return q, seen


def _rolled(
    model: mujoco.MjModel, data: mujoco.MjData, qpos: np.ndarray, dofs: np.ndarray, ctrl: Float64,
    pushes: Float64,
) -> tuple[Float64, Float64]:  # fmt: skip
    """Do the same where nothing has to be asked from step to step, at once."""
    spec = int(mujoco.mjtState.mjSTATE_CTRL) | int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)
    control = np.zeros((len(ctrl), model.nu + model.nv))
    control[:, : ctrl.shape[1]] = ctrl
    control[:, model.nu + dofs] = pushes
    kind = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    states, sensors = _roll(model, data, state[None], control, control_spec=spec)
    mujoco.mj_setState(model, data, states[0, -1], kind)
    tool = int(model.sensor(f"{TOOL}/position").adr[0])
    first = mujoco.mj_stateSize(model, int(mujoco.mjtState.mjSTATE_TIME))
    q = np.concatenate([state[None, first + qpos], states[0, :-1][:, first + qpos]])
    return q, sensors[0, :, tool : tool + 7]


def _begin(
    model: mujoco.MjModel, data: mujoco.MjData, qpos: np.ndarray, rest: Float64, ctrl: Float64
) -> None:
    """Put it at rest, with every delay line full of the first command."""
    data.qpos[qpos] = rest
    data.ctrl[: len(ctrl)] = ctrl
    mujoco.mj_forward(model, data)
    for index in range(len(model.actuator_trntype)):  # nu counts controls
        if samples := int(model.actuator_history[index, 0]):
            adr, count = int(model.actuator_ctrladr[index]), int(model.actuator_ctrlnum[index])
            values = np.tile(ctrl[adr : adr + count], (samples, 1))
            mujoco.mj_initCtrlHistory(model, data, index, None, np.ascontiguousarray(values))
