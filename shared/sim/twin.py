"""One live bout in real time: the robot that fences, and opposite it a second one or a person.

The physics is that of training. Between a command and the servo lie what lies there on the robot:
transport delay and filter (``servo.py``), and the controller's velocity saturation, which bounds
the distance that its spring acts on and with it the static force. A person's bat is a body that
is where it is tracked; nothing pushes it.
"""

from typing import Final

import msgspec
import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.build import AGENTS, CONTROLS, SENSORS, build_spec
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.parameters import CommandParameters
from shared.sim.servo import CommandPath, blend

JOINTS: Final = 7
EFFORT_LIMITS: Final = (30.0, 30.0, 30.0, 30.0, 30.0, 10.0, 10.0)
"""Of the PR2's arm joints, shoulder to wrist (N m; pr2.urdf)."""
_TOOL: Final = 13
_PERSON: Final = "antagonist"


class Twin:
    """A world with the robot at index 1, the protagonist's, and its opponent at index 0."""

    def __init__(
        self, model: FencingModel, command: CommandParameters, max_force: float, *, person: bool
    ) -> None:
        """Build the world, en garde.

        Args:
            model: the scene and the simulator's parameters.
            command: delay and filter where the model has none of its own.
            max_force: of the controller, static (N).
            person: whether the opponent is a tracked bat instead of a robot.
        """
        self.model = model
        self._agents = AGENTS[1:] if person else AGENTS
        self._has_person = person
        cfg, parameters = model.cfg, model.parameters
        self._mj = _with_person(cfg, model) if person else model.mj
        self._data = mujoco.MjData(self._mj)
        self._substeps = cfg.substeps
        own = parameters.command
        self._command = command if own.is_direct else own
        self._lead = max_force / parameters.servo.translation.kp
        self._stiffness = parameters.servo.translation
        self._sensors: Float64 = self._data.sensordata[: len(self._agents) * SENSORS]
        self._ctrl: Float64 = self._data.ctrl[: len(self._agents) * CONTROLS]
        self.is_limp = False
        """Whether the motors are off: joints only brake."""
        self.reset()

    @property
    def has_arms(self) -> tuple[bool, bool]:
        """Return which side a robot plays, antagonist first."""
        return not self._has_person, True

    def reset(self) -> None:
        """Put the robots at rest en garde, each commanded to stay there."""
        mujoco.mj_resetData(self._mj, self._data)
        posture = self.model.en_garde[2 - len(self._agents) :]
        self._data.qpos[:] = posture.ravel()
        mujoco.mj_forward(self._mj, self._data)
        self._path = CommandPath(
            self._command, 1, len(self._agents), self.model.cfg.control_timestep, self._substeps
        )
        self.latch()

    def latch(self) -> None:
        """Make the robots' controllers hold where they are, as a restart of them does."""
        self._tools = self.tools()
        ours = self._tools[2 - len(self._agents) :]
        self._ctrl[:] = ours.ravel()
        self._path.reset(np.zeros(1, np.int64), ours.reshape(1, -1))

    def command(self, side: int, pose: Float64) -> None:
        """Give a robot's controller a new target.

        Args:
            side: 0 antagonist, 1 protagonist.
            pose: float64[7], position (m) and orientation of the tool in its torso frame.
        """
        self._tools[side] = pose

    def place_person(self, bat: Float64) -> None:
        """Put the person's bat where it is tracked: float64[13], of which the pose counts."""
        if self._has_person:
            self._data.mocap_pos[0] = bat[:3]
            self._data.mocap_quat[0] = bat[3:7]

    def step(self) -> None:
        """Go on by one control step."""
        self._path.accept(self._tools[2 - len(self._agents) :].reshape(1, -1))
        for substep in range(self._substeps):
            held = self._path.advance(substep).reshape(-1, CONTROLS)
            for index, side in enumerate(range(2 - len(self._agents), 2)):
                self._ctrl.reshape(-1, CONTROLS)[index] = self._held(side, held[index])
            mujoco.mj_step(self._mj, self._data)
        mujoco.mj_fwdPosition(self._mj, self._data)
        mujoco.mj_sensorPos(self._mj, self._data)
        mujoco.mj_fwdVelocity(self._mj, self._data)
        mujoco.mj_sensorVel(self._mj, self._data)

    def bat(self, side: int) -> Float64:
        """Return float64[13] of a robot's bat: pose, linear and angular velocity, world frame."""
        return self._of(side)[:_TOOL].copy()

    def tools(self) -> Float64:
        """Return float64[2, 7]: the tools in their torso frames, zeros for a person."""
        out = np.zeros((2, CONTROLS))
        out[2 - len(self._agents) :] = self._sensors.reshape(-1, SENSORS)[:, _TOOL:]
        return out

    def joints(self) -> tuple[Float64, Float64]:
        """Return float64[2, 7] positions (rad) and velocities (rad/s), zeros for a person."""
        positions, velocities = np.zeros((2, 2, JOINTS))
        first = 2 - len(self._agents)
        positions[first:] = self._data.qpos.reshape(-1, JOINTS)
        velocities[first:] = self._data.qvel.reshape(-1, JOINTS)
        return positions, velocities

    def force(self, side: int) -> float:
        """Return the force that a robot's servo puts on its tool (N)."""
        of = self._of(side)
        held = self._ctrl.reshape(-1, CONTROLS)[side - (2 - len(self._agents)), :3]
        yaw = self.model.base_yaw[side]
        cosine, sine = np.cos(yaw), np.sin(yaw)
        vx, vy, vz = of[7:10]
        velocity = np.array([cosine * vx + sine * vy, cosine * vy - sine * vx, vz])
        spring = self._stiffness.kp * (held - of[_TOOL : _TOOL + 3])
        return float(np.linalg.norm(spring - self._stiffness.kv * velocity))

    def efforts(self, side: int) -> Float64:
        """Return float64[7], what the servo puts on a robot's joints (N m)."""
        return self._data.qfrc_actuator.reshape(-1, JOINTS)[side - (2 - len(self._agents))].copy()

    def effort_share(self, side: int) -> float:
        """Return the largest share of its effort limit that a joint of a robot gives."""
        return float(np.max(np.abs(self.efforts(side)) / EFFORT_LIMITS))

    def is_finite(self) -> bool:
        """Return whether the physics is still made of numbers."""
        return bool(np.isfinite(self._data.qpos).all() and np.isfinite(self._data.qvel).all())

    def _of(self, side: int) -> Float64:
        return self._sensors.reshape(-1, SENSORS)[side - (2 - len(self._agents))]

    def _held(self, side: int, pose: Float64) -> Float64:
        """Return what the servo's spring acts towards."""
        tool = self._of(side)[_TOOL:]
        if self.is_limp:
            return tool
        far = float(np.linalg.norm(pose[:3] - tool[:3]))
        if far <= self._lead:
            return pose
        out = pose.copy()
        out[:3] = blend(tool, pose, self._lead / far)[:3]
        return out


def _with_person(cfg: SimConfig, model: FencingModel) -> mujoco.MjModel:
    """Return the scene with one robot, and opposite it a bat that is where it is put."""
    bat = model.parameters.bat
    spec = build_spec(cfg, model.parameters, AGENTS[1:])
    body = spec.worldbody.add_body(name=f"{_PERSON}/bat", mocap=True, pos=[1.0, 0.0, 1.0])
    body.add_geom(
        name=f"{_PERSON}/bat",
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[model.bat_back, 0.0, 0.0, model.bat_front, 0.0, 0.0],
        size=[bat.radius, 0.0, 0.0],
        contype=0,
        conaffinity=0,
    )
    spec.add_pair(
        name="bats", geomname1=f"{_PERSON}/bat", geomname2=f"{AGENTS[1]}/bat", condim=3
    )  # fmt: skip
    return spec.compile()


def command_of(filter: float, delay: float) -> CommandParameters:
    """Return what lies between a command and a servo."""
    return msgspec.convert({"filter": filter, "delay": delay}, CommandParameters)
