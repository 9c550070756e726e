"""Where the bodies of the scene are, given the joints; no physics, for those who draw."""

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.batch import Float32
from shared.sim.model import FencingModel


class Kinematics:
    """Forward kinematics of both arms."""

    def __init__(self, model: FencingModel) -> None:
        self._model = model.mj
        self._data = mujoco.MjData(model.mj)

    def poses(self, joints: Float64) -> tuple[Float32, Float32]:
        """Return the poses of all bodies at F instants, in the order of ``model.body_names``.

        Args:
            joints: float64[F, 2, 7] (rad), antagonist first.

        Returns:
            float32[F, B, 3] positions (m) and float32[F, B, 4] quaternions, w x y z.
        """
        bodies = self._model.nbody
        positions = np.empty((len(joints), bodies, 3), np.float32)
        quaternions = np.empty((len(joints), bodies, 4), np.float32)
        for k, instant in enumerate(joints):
            self._data.qpos[:] = instant.ravel()
            mujoco.mj_kinematics(self._model, self._data)
            positions[k] = self._data.xpos
            quaternions[k] = self._data.xquat
        return positions, quaternions
