"""Many fencing worlds stepped together."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Final

import mujoco
import numpy as np
from mujoco import batch as mujoco_batch
from numpy.typing import NDArray

from shared.sim.arm import Float64
from shared.sim.build import AGENTS, CONTROLS, SENSORS
from shared.sim.model import FencingModel
from shared.sim.nan_guard import NanGuard
from shared.sim.servo import CommandPath

Float32 = NDArray[np.float32]
Int64 = NDArray[np.int64]

_STAGE: Final = int(mujoco.mjtStage.mjSTAGE_VEL)
"""What makes every sensor current; the next step continues from it, so it costs nothing."""
_TOOL: Final = 13
"""Where the tool's pose begins among an agent's sensors."""


class FencingBatch:
    """N worlds with both arms, stepped one control step at a time.

    Worlds are independent and their results do not depend on ``num_threads``. One Python
    thread may use a batch at a time. ``sensors``, ``ctrl``, ``qpos`` and ``qvel`` are live:
    read and write them in place, never rebind them.
    """

    sensors: Float64
    """float64[N, 40], antagonist first. Per agent: the bat's position (m), quaternion (w, x, y,
    z), linear and angular velocity (m/s, rad/s) in the world frame, then the tool's position
    and quaternion in the agent's torso frame."""
    ctrl: Float64
    """float64[N, 14], antagonist first. Per agent: the desired position (m) and quaternion
    (w, x, y, z; any length but zero) of the tool in the agent's torso frame."""
    qpos: Float64
    """float64[N, 14], joint angles, antagonist first (rad)."""
    qvel: Float64
    """float64[N, 14] (rad/s)."""

    def __init__(
        self,
        model: FencingModel,
        num_envs: int,
        num_threads: int = 1,
        dump_folder: Path | None = None,
    ) -> None:
        """Create the worlds, all en garde.

        Args:
            model: the scene.
            num_envs: how many worlds.
            num_threads: how many threads step them; results do not depend on it.
            dump_folder: where :meth:`check` leaves the last states of a diverged world; a new
                temporary folder if None.
        """
        if num_envs < 1 or num_threads < 1:
            raise ValueError(
                f"num_envs ({num_envs}) and num_threads ({num_threads}) must be at least 1"
            )
        self.model = model
        self.num_envs = num_envs
        self._batch = mujoco_batch.Batch(model.mj, num_envs, num_threads, persistent=True)
        self._data = mujoco.MjData(model.mj)
        self._begin: Float64 = self._batch.state[0].copy()
        self._applied: Float64 = self._batch.bind("ctrl")[:, : len(AGENTS) * CONTROLS]
        self.sensors = self._batch.bind("sensordata")[:, : len(AGENTS) * SENSORS]
        self.qpos = self._batch.bind("qpos")
        self.qvel = self._batch.bind("qvel")
        cfg = model.cfg
        self._path: CommandPath | None = None
        # step() advances every world by one control step; sensors are current afterwards.
        if model.parameters.command.is_direct:
            self.ctrl = self._applied
            self._advance = partial(self._batch.step, None, cfg.substeps, _STAGE)
            self.step: Callable[[], None] = self._step_direct
        else:
            self.ctrl = np.zeros_like(self._applied)
            self._advance = partial(self._batch.step, None, 1, _STAGE)
            self._path = CommandPath(
                model.parameters.command,
                num_envs,
                len(AGENTS),
                cfg.control_timestep,
                cfg.substeps,
            )
            self.step = partial(self._step_through, self._path)
        self._guard = NanGuard(
            model.mj,
            self._batch.state,
            self._applied,
            cfg.substeps if self._path is None else 1,
            model.to_xml,
            dump_folder,
        )
        self.reset(np.arange(num_envs), np.tile(model.en_garde.ravel(), (num_envs, 1)))

    def _step_direct(self) -> None:
        self._guard.record()
        self._advance()

    def _step_through(self, path: CommandPath) -> None:
        path.accept(self.ctrl)
        for substep in range(self.model.cfg.substeps):
            self._applied[:] = path.advance(substep)
            self._guard.record()
            self._advance()

    def others(self, num_envs: int) -> "FencingBatch":
        """Return so many other worlds of the same model, stepped by one thread, all en garde."""
        return FencingBatch(self.model, num_envs)

    def reset(self, ids: Int64, qpos: Float64) -> None:
        """Put worlds at rest in a posture, each tool commanded to stay where it is.

        Args:
            ids: int64[K], the worlds, each at most once.
            qpos: float64[K, 14], joint angles, antagonist first (rad).
        """
        if len(ids) == 0:
            return
        self._batch.state[ids] = self._begin
        self.qpos[ids] = qpos
        self._batch.forward(np.sort(ids), _STAGE)
        rows = self.sensors[ids]
        tools = np.concatenate([rows[:, _TOOL:SENSORS], rows[:, SENSORS + _TOOL :]], axis=1)
        self._applied[ids] = tools
        if self._path is not None:
            self.ctrl[ids] = tools
            self._path.reset(ids, tools)
        self._guard.begin(ids)

    def body_poses(self, world: int) -> tuple[Float32, Float32]:
        """Return the poses of one world's bodies, in the order of ``model.body_names``.

        Returns:
            float32[B, 3] positions (m) and float32[B, 4] quaternions (w, x, y, z).
        """
        data = self._batch.get_data(world, self._data)
        return data.xpos.astype(np.float32), data.xquat.astype(np.float32)

    def state(self) -> Float64:
        """Return float64[N, S], everything a bit-identical continuation needs."""
        if self._path is None:
            return self._batch.state.copy()
        return np.concatenate([self._batch.state, self.ctrl, self._path.state()], axis=1)

    def restore(self, state: Float64) -> None:
        """Continue from what :meth:`state` returned.

        Raises:
            ValueError: if ``state`` is not of this model and number of worlds.
        """
        physics = self._batch.state.shape[1]
        extra = 0 if self._path is None else self._path.size + self.ctrl.shape[1]
        if state.shape != (self.num_envs, physics + extra):
            raise ValueError(
                f"this batch needs a state of shape {(self.num_envs, physics + extra)}, "
                f"got {state.shape}"
            )
        self._batch.state[:] = state[:, :physics]
        if self._path is not None:
            commands = physics + self.ctrl.shape[1]
            self.ctrl[:] = state[:, physics:commands]
            self._path.restore(state[:, commands:])
        self._batch.forward(None, _STAGE)
        self._guard.begin(np.arange(self.num_envs))

    def check(self) -> None:
        """Make sure that every world is still finite; cheap, once per rollout is enough.

        Raises:
            SimulationError: if a world diverged; its last 100 states and the model are on disk
                and the message names the file.
        """
        self._guard.inspect(self._batch.warning)
