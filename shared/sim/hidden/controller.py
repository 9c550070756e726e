"""Controllers beside the arm, which know it by its encoders alone.

The simulator's servos act at the tool, or at the joint, itself. That is the same as long as
encoders, joints and model agree; where they do not, a real controller does not know.
"""

from typing import Protocol

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import Plant


class Controller(Protocol):
    """What turns a command into torques."""

    def torques(self, command: Float64, q: Float64, qd: Float64) -> Float64:
        """Return float64[J], what the joints' drives are told to do (N m).

        Args:
            command: float64[U].
            q: float64[J], what the encoders say (rad).
            qd: float64[J] (rad/s).
        """
        ...


def controller_of(plant: Plant, robot: mujoco.MjModel) -> Controller:
    """Return a controller in the place of a compiled robot's servos, with their gains.

    Args:
        plant: what the controller believes the arm to be.
        robot: whose servos are switched off.
    """
    return _Poses(plant, robot) if plant.control == "pose" else _Positions(plant, robot)


class _Poses:
    """Jacobian-transpose control on a model of the arm: J^T (kp error - kv J qvel), clipped."""

    def __init__(self, plant: Plant, robot: mujoco.MjModel) -> None:
        self._model = plant.make().compile()
        self._data = mujoco.MjData(self._model)
        self._qpos = np.array([int(self._model.joint(name).qposadr[0]) for name in plant.joints])
        self._dofs = np.array([int(self._model.joint(name).dofadr[0]) for name in plant.joints])
        for name in plant.actuators:
            mine, its = int(self._model.actuator(name).id), int(robot.actuator(name).id)
            self._model.actuator_gainprm[mine] = robot.actuator_gainprm[its]
            self._model.actuator_biasprm[mine] = robot.actuator_biasprm[its]
            robot.actuator_gainprm[its] = 0.0
            robot.actuator_biasprm[its] = 0.0

    def torques(self, command: Float64, q: Float64, qd: Float64) -> Float64:
        model, data = self._model, self._data
        data.qpos[self._qpos], data.qvel[self._dofs] = q, qd
        data.ctrl[:] = command
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_fwdActuation(model, data)
        return data.qfrc_actuator[self._dofs].copy()


class _Positions:
    """A proportional-derivative controller a joint, in the order of the joints, clipped."""

    def __init__(self, plant: Plant, robot: mujoco.MjModel) -> None:
        servos = [int(robot.actuator(name).id) for name in plant.actuators]
        self._kp = robot.actuator_gainprm[servos, 0].copy()
        self._kv = -robot.actuator_biasprm[servos, 2].copy()
        self._low, self._high = robot.actuator_forcerange[servos].T.copy()
        robot.actuator_gainprm[servos] = 0.0
        robot.actuator_biasprm[servos] = 0.0

    def torques(self, command: Float64, q: Float64, qd: Float64) -> Float64:
        return np.clip(self._kp * (command - q) - self._kv * qd, self._low, self._high)
