"""Many fencing worlds stepped together."""

# pyright: basic
# (mujoco's bindings carry no types)

from functools import partial
from typing import Final

import mujoco
import numpy as np
from mujoco import batch as mujoco_batch
from numpy.typing import NDArray

from shared.errors import SimulationError
from shared.sim.arm import Float64
from shared.sim.build import AGENTS, CONTROLS, SENSORS
from shared.sim.model import FencingModel

Float32 = NDArray[np.float32]
Int64 = NDArray[np.int64]

_VELOCITY_STAGE: Final = int(mujoco.mjtStage.mjSTAGE_VEL)
_TOOL: Final = 13
"""Where the tool's pose begins among an agent's sensors."""


class FencingBatch:
    """N worlds with both arms, stepped one control step at a time.

    Worlds are independent and their results do not depend on ``num_threads``. One Python
    thread may use a batch at a time.
    """

    def __init__(self, model: FencingModel, num_envs: int, num_threads: int = 1) -> None:
        if num_envs < 1 or num_threads < 1:
            raise ValueError(
                f"num_envs ({num_envs}) and num_threads ({num_threads}) must be at least 1"
            )
        self.model = model
        self.num_envs = num_envs
        self._batch = mujoco_batch.Batch(model.mj, num_envs, num_threads, persistent=True)
        self._data = mujoco.MjData(model.mj)
        width = len(AGENTS)
        self.sensors: Float64 = self._batch.bind("sensordata")[:, : width * SENSORS]
        """float64[N, 40], live, antagonist first. Per agent: the bat's position (m), quaternion
        (w, x, y, z), linear and angular velocity (m/s, rad/s) in the world frame, then the tool's
        position and quaternion in the agent's torso frame."""
        self.ctrl: Float64 = self._batch.bind("ctrl")[:, : width * CONTROLS]
        """float64[N, 14], live, antagonist first. Per agent: the desired position (m) and
        quaternion (w, x, y, z) of the tool in the agent's torso frame."""
        self.qpos: Float64 = self._batch.bind("qpos")
        """float64[N, 14], live: joint angles, antagonist first (rad)."""
        self.qvel: Float64 = self._batch.bind("qvel")
        """float64[N, 14], live (rad/s)."""
        self._advance = partial(
            self._batch.step, None, model.cfg.substeps, _VELOCITY_STAGE
        )
        self._begin = self._batch.state[0].copy()
        everyone = np.arange(num_envs)
        self.reset(everyone, np.tile(model.en_garde.ravel(), (num_envs, 1)))

    def step(self) -> None:
        """Advance every world by one control step; ``sensors`` are current afterwards."""
        self._advance()

    def reset(self, ids: Int64, qpos: Float64) -> None:
        """Put worlds at rest in a posture, each tool commanded to stay where it is.

        Args:
            ids: int64[K], the worlds.
            qpos: float64[K, 14], joint angles, antagonist first (rad).
        """
        self._batch.state[ids] = self._begin
        self.qpos[ids] = qpos
        self._batch.forward(ids, _VELOCITY_STAGE)
        self.ctrl[ids] = self._tools(ids)

    def body_poses(self, world: int) -> tuple[Float32, Float32]:
        """Return the poses of one world's bodies, in the order of ``model.body_names``.

        Returns:
            float32[B, 3] positions (m) and float32[B, 4] quaternions (w, x, y, z).
        """
        data = self._batch.get_data(world, self._data)
        return data.xpos.astype(np.float32), data.xquat.astype(np.float32)

    def state(self) -> Float64:
        """Return float64[N, S], everything a bit-identical continuation needs."""
        return self._batch.state.copy()

    def restore(self, state: Float64) -> None:
        """Continue from what :meth:`state` returned.

        Raises:
            ValueError: if ``state`` is not of this model and number of worlds.
        """
        if state.shape != self._batch.state.shape:
            raise ValueError(
                f"the state is {state.shape}, this batch needs {self._batch.state.shape}"
            )
        self._batch.state[:] = state
        self._batch.forward(None, _VELOCITY_STAGE)

    def check(self) -> None:
        """Raise if the physics of any world went wrong.

        Raises:
            SimulationError: naming the world and what MuJoCo said.
        """
        if self._batch.warning.any():
            world = int(np.flatnonzero(self._batch.warning.any(axis=1))[0])
            raise SimulationError(f"world {world} diverged")

    def _tools(self, ids: Int64) -> Float64:
        """Return float64[K, 14]: both tools' current poses, as controls."""
        rows = self.sensors[ids]
        return np.concatenate(
            [rows[:, start + _TOOL : start + SENSORS] for start in (0, SENSORS)], axis=1
        )
