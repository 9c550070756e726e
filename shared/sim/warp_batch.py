"""Many fencing worlds stepped together on a graphics card, by mujoco_warp, in single precision.

mujoco_warp 4.0.0 has no orientation actuator, so the model is built with goal sites
(``build_spec(has_goal_sites=True)``): a command's orientation is a site's, each world having its
own, and its position three controls. The torque is the same; what differs from ``FencingBatch`` is
rounding (``tests/integration/sim/test_warp.py`` holds the two side by side, step by step).

Policies, observation and judging stay where they are, on the processor: what crosses for each
control step is 14 numbers a world one way and 68 the other, through memory that the card reaches by
itself. What is launched for a step is recorded once and then launched whole.
"""

import importlib
from collections.abc import Callable
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from shared.errors import ConfigError, SimulationError
from shared.sim.arm import Float64
from shared.sim.batch import Float32, Int64
from shared.sim.build import AGENTS, CONTROLS, SENSORS, build_spec
from shared.sim.model import FencingModel
from shared.sim.servo import CommandPath

_TOOL: Final = 13
"""Where the tool's pose begins among an agent's sensors."""
_KEPT: Final = ("qpos", "qvel", "qacc_warmstart")
"""What a continuation needs of a world."""
_SEEN: Final = ("sensordata", "qpos", "qvel")
"""What the processor works with after each step."""
_CONTACTS_OF_A_PAIR: Final = 4
"""More than two capsules can have."""


class WarpBatch:
    """N worlds with both arms; takes the place of :class:`FencingBatch`.

    ``sensors``, ``qpos`` and ``qvel`` are copies, current after each step; ``ctrl`` is read by the
    next one. Only ``reset`` and ``restore`` change a world's state.
    """

    def __init__(self, model: FencingModel, num_envs: int, device: str = "") -> None:
        """Create the worlds, all en garde; the first time on a machine kernels are compiled.

        Args:
            model: the scene.
            num_envs: how many worlds.
            device: ``cuda:0``, or ``cpu``, which is slow; empty takes the first card.

        Raises:
            ConfigError: mujoco_warp is not installed, or there is no such device.
        """
        if num_envs < 1:
            raise ValueError(f"num_envs ({num_envs}) must be at least 1")
        self._warp, self._mjw, self._kernels = _libraries()
        self._device = _device_of(self._warp, device)
        self.model = model
        self.num_envs = num_envs
        mj = _without_orientation_actuators(model)
        data = mujoco.MjData(mj)
        data.qpos[:] = model.en_garde.ravel()
        mujoco.mj_forward(mj, data)
        contacts, rows = _most(mj)
        with self._warp.ScopedDevice(self._device):
            self._m = self._mjw.put_model(mj)
            self._d = self._mjw.put_data(mj, data, nworld=num_envs, nconmax=contacts, njmax=rows)
            quats = np.tile(mj.site_quat.astype(np.float32), (num_envs, 1, 1))
            self._m.site_quat = self._warp.array(quats, dtype=self._warp.quat)
            self._goals = self._warp.array(
                [mj.site(f"{agent}/goal").id for agent in AGENTS], dtype=int
            )
            self._moves = self._warp.array(
                [mj.actuator(f"{agent}/{axis}").id for agent in AGENTS for axis in "xyz"], dtype=int
            )
            poses = self._warp.empty((num_envs, len(AGENTS) * CONTROLS), dtype=float)
        self._commands = _Mirror(self._warp, poses)
        self._seen = {name: _Mirror(self._warp, getattr(self._d, name)) for name in _SEEN}
        self.sensors: Float64 = np.empty((num_envs, len(AGENTS) * SENSORS))
        self.qpos: Float64 = np.empty((num_envs, mj.nq))
        self.qvel: Float64 = np.empty((num_envs, mj.nv))
        self.ctrl: Float64 = np.zeros((num_envs, len(AGENTS) * CONTROLS))
        cfg = model.cfg
        self._path: CommandPath | None = None
        if not model.parameters.command.is_direct:
            self._path = CommandPath(
                model.parameters.command, num_envs, len(AGENTS), cfg.control_timestep, cfg.substeps
            )
        self._advance = _Launches(self._warp, self._device, self._physics)
        self._make_current = _Launches(self._warp, self._device, self._kinematics)
        self.reset(np.arange(num_envs), np.tile(model.en_garde.ravel(), (num_envs, 1)))

    def step(self) -> None:
        """Advance every world by one control step; ``sensors`` are current afterwards."""
        if self._path is None:
            self._command(self.ctrl)
        else:
            self._path.accept(self.ctrl)
        for substep in range(self.model.cfg.substeps):
            if self._path is not None:
                self._command(self._path.advance(substep))
            self._advance()
        self._look()

    def others(self, num_envs: int) -> "WarpBatch":
        """Return so many other worlds of the same model, on the same device, all en garde."""
        return WarpBatch(self.model, num_envs, self._device)

    def reset(self, ids: Int64, qpos: Float64) -> None:
        """Put worlds at rest in a posture, each tool commanded to stay where it is.

        Args:
            ids: int64[K], the worlds, each at most once.
            qpos: float64[K, 14], joint angles, antagonist first (rad).
        """
        if len(ids) == 0:
            return
        values = {name: getattr(self._d, name).numpy() for name in _KEPT}
        for value in values.values():
            value[ids] = 0.0
        values["qpos"][ids] = qpos
        self._write(values)
        self._look()
        rows = self.sensors[ids]
        tools = np.concatenate([rows[:, _TOOL:SENSORS], rows[:, SENSORS + _TOOL :]], axis=1)
        self.ctrl[ids] = tools
        if self._path is not None:
            self._path.reset(ids, tools)

    def body_poses(self, world: int) -> tuple[Float32, Float32]:
        """Return the poses of one world's bodies, in the order of ``model.body_names``.

        Returns:
            float32[B, 3] positions (m) and float32[B, 4] quaternions (w, x, y, z).
        """
        return self._d.xpos.numpy()[world], self._d.xquat.numpy()[world]

    def state(self) -> Float64:
        """Return float64[N, S], everything a continuation needs."""
        parts = [getattr(self._d, name).numpy().astype(np.float64) for name in _KEPT]
        parts.append(self.ctrl)
        if self._path is not None:
            parts.append(self._path.state())
        return np.concatenate(parts, axis=1)

    def restore(self, state: Float64) -> None:
        """Continue from what :meth:`state` returned.

        Raises:
            ValueError: if ``state`` is not of this model and number of worlds.
        """
        shape = self.state().shape
        if state.shape != shape:
            raise ValueError(f"this batch needs a state of shape {shape}, got {state.shape}")
        at = 0
        values: dict[str, NDArray[np.float32]] = {}
        for name in _KEPT:
            width = getattr(self._d, name).shape[1]
            values[name] = state[:, at : at + width].astype(np.float32)
            at += width
        self._write(values)
        self.ctrl[:] = state[:, at : at + self.ctrl.shape[1]]
        if self._path is not None:
            self._path.restore(state[:, at + self.ctrl.shape[1] :])
        self._look()

    def check(self) -> None:
        """Make sure that every world is still finite, and that none had more contacts than fit.

        Raises:
            SimulationError: if one is not; names it.
        """
        broken = np.flatnonzero(~np.isfinite(self.qpos).all(1) | ~np.isfinite(self.qvel).all(1))
        if len(broken):
            raise SimulationError(
                f"{len(broken)} of {self.num_envs} worlds on {self._device} hold values that are "
                f"not finite, world {broken[0]} first"
            )
        kinds = self._mjw.OverflowType
        lost = kinds.NEFC | kinds.BROADPHASE | kinds.NARROWPHASE | kinds.CCD
        full = np.flatnonzero(self._d.overflow.numpy() & int(lost))
        if len(full):
            raise SimulationError(
                f"{len(full)} of {self.num_envs} worlds on {self._device} had more contacts than "
                f"there is room for, world {full[0]} first: some were left out"
            )

    def _command(self, ctrl: Float64) -> None:
        """Bring float64[N, 14] to the device."""
        self._warp.synchronize_device(self._device)  # it may still read what the last one was
        self._commands.here[:] = ctrl
        self._commands.send()

    def _physics(self) -> None:
        """Take what was sent as controls and goals, and step."""
        self._warp.launch(
            self._kernels.take_commands,
            dim=(self.num_envs, len(AGENTS)),
            inputs=[self._commands.there, self._moves, self._goals],
            outputs=[self._d.ctrl, self._m.site_quat],
        )
        self._mjw.step(self._m, self._d)

    def _kinematics(self) -> None:
        """Make current what sensors read of positions and velocities, and no more than that."""
        self._mjw.kinematics(self._m, self._d)
        self._mjw.com_pos(self._m, self._d)
        self._mjw.sensor_pos(self._m, self._d)
        self._mjw.com_vel(self._m, self._d)
        self._mjw.sensor_vel(self._m, self._d)

    def _look(self) -> None:
        """Make every sensor current, and copy what the processor works with."""
        self._make_current()
        for mirror in self._seen.values():
            mirror.fetch()
        self._warp.synchronize_device(self._device)
        self.sensors[:] = self._seen["sensordata"].here[:, : self.sensors.shape[1]]
        self.qpos[:] = self._seen["qpos"].here
        self.qvel[:] = self._seen["qvel"].here

    def _write(self, values: dict[str, NDArray[np.float32]]) -> None:
        for name, value in values.items():
            getattr(self._d, name).assign(np.ascontiguousarray(value, np.float32))


class _Mirror:
    """An array of the device and its copy here, in memory that a card reads and writes itself."""

    def __init__(self, warp: Any, there: Any) -> None:
        self._warp, self.there = warp, there
        self._host = warp.empty_like(there, device="cpu", pinned=there.device.is_cuda)
        warp.copy(self._host, there)
        warp.synchronize_device(there.device)
        self.here: NDArray[np.float32] = self._host.numpy()
        """The copy; what is written into it is sent, and must stay until the device had it."""

    def send(self) -> None:
        """Put what is here in the queue of what goes to the device."""
        self._warp.copy(self.there, self._host)

    def fetch(self) -> None:
        """Put what is there in the queue of what comes from it."""
        self._warp.copy(self._host, self.there)


class _Launches:
    """Kernels launched in the same order each time: on a card, one graph instead of each."""

    def __init__(self, warp: Any, device: str, launch: Callable[[], None]) -> None:
        self._warp, self._device, self._launch = warp, device, launch
        self._is_card = bool(warp.get_device(device).is_cuda)
        self._has_run = False
        self._graph: Any = None

    def __call__(self) -> None:
        """Launch them; the first time plainly: that loads kernels, which no recording may."""
        with self._warp.ScopedDevice(self._device):
            if not (self._is_card and self._has_run):
                self._launch()
                self._has_run = True
                return
            if self._graph is None:  # recording launches nothing
                with self._warp.ScopedCapture() as capture:
                    self._launch()
                self._graph = capture.graph
            self._warp.capture_launch(self._graph)


def _most(mj: mujoco.MjModel) -> tuple[int, int]:
    """Return the most contacts, and rows of constraints, that a world can have."""
    contacts = _CONTACTS_OF_A_PAIR * mj.npair
    dry, limited = int((mj.dof_frictionloss > 0).sum()), int(mj.jnt_limited.sum())
    of_a_contact = int(2 * (mj.pair_dim.max(initial=1) - 1))  # of a pyramid
    return max(contacts, 1), max(dry + limited + contacts * of_a_contact, 1)


def _without_orientation_actuators(model: FencingModel) -> mujoco.MjModel:
    mj = build_spec(model.cfg, model.parameters, has_goal_sites=True).compile()
    # What a diverged world does is not asked of mujoco_warp, which refuses the flag.
    mj.opt.disableflags &= ~int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return mj


def _libraries() -> tuple[Any, Any, Any]:
    """Return warp, mujoco_warp and our kernels."""
    try:
        warp: Any = importlib.import_module("warp")
        warp.config.log_level = warp.LOG_WARNING
        mjw = importlib.import_module("mujoco_warp")
        return warp, mjw, importlib.import_module("shared.sim.warp_kernels")
    except ImportError as error:
        raise ConfigError(
            f"the back end 'warp' needs mujoco_warp ({error}): pip install 'riposte[gpu]'"
        ) from error


def _device_of(warp: Any, device: str) -> str:
    """Return the name of a device that is there."""
    warp.init()
    cards = [str(card) for card in warp.get_cuda_devices()]
    if not device and cards:
        return cards[0]
    if device not in ("cpu", *cards):
        raise ConfigError(
            f"the back end 'warp' wants the device {device or 'cuda:0'!r}, and here are "
            f"{', '.join(('cpu', *cards))}; actor.backend = 'cpu' needs none"
        )
    return device
