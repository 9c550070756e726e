"""Tells what led up to a world that diverged, at next to no cost while none does.

Copying every state of every step would cost a percent of the physics. So only the controls are
kept, and a state every 100 steps: the physics is deterministic, the steps between are repeated.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from shared.errors import SimulationError
from shared.sim.arm import Float64

DEPTH: Final = 100
"""Calls of ``Batch.step`` whose states a dump holds, before the last."""

_FIELDS: Final = ("time", "qpos", "qvel", "act", "qacc_warmstart", "ctrl")
_WHOLE: Final = mujoco.mjtState.mjSTATE_INTEGRATION


class NanGuard:
    """Watches N worlds."""

    def __init__(
        self,
        mj: mujoco.MjModel,
        state: Float64,
        ctrl: Float64,
        nstep: int,
        xml: Callable[[], str],
        folder: Path | None,
    ) -> None:
        """Watch a batch.

        Args:
            mj: the compiled physics.
            state: float64[N, S], the batch's live ``mjSTATE_INTEGRATION`` rows.
            ctrl: float64[N, U], the live controls among them.
            nstep: physics steps in one call of ``Batch.step``.
            xml: returns the model as text, asked only for a dump.
            folder: where dumps go; a new temporary folder if None.
        """
        self._mj = mj
        self._state = state
        self._ctrl = ctrl
        self._nstep = nstep
        self._xml = xml
        self._folder = folder
        self._ring = np.zeros((2 * DEPTH, *ctrl.shape))
        self._starts = np.zeros((2, *state.shape))
        self._started_at = np.zeros((2, len(state)), np.int64)
        self._calls = 0

    def begin(self, ids: np.ndarray) -> None:
        """Forget what came before: these worlds were put into a new state."""
        self._starts[:, ids] = self._state[ids]
        self._started_at[:, ids] = self._calls

    def record(self) -> None:
        """Keep the controls that the next call of ``Batch.step`` will apply."""
        if self._calls % DEPTH == 0:
            self._starts[0], self._started_at[0] = self._starts[1], self._started_at[1]
            self._starts[1], self._started_at[1] = self._state, self._calls
        self._ring[self._calls % len(self._ring)] = self._ctrl
        self._calls += 1

    def inspect(self, warnings: np.ndarray) -> None:
        """Dump and raise if a world warned or holds a number that is not finite.

        Args:
            warnings: int[N, W, 2], MuJoCo's warnings: last detail and count.

        Raises:
            SimulationError: naming the world and the file its last states are in.
        """
        if not warnings.any() and np.isfinite(self._state).all():
            return
        counts = warnings[:, :, 1]
        finite = np.isfinite(self._state).all(axis=1)
        bad = np.logical_or(counts.any(axis=1), np.logical_not(finite))
        world = int(np.flatnonzero(bad)[0])
        kinds = list(mujoco.mjtWarning.__members__)
        said = [kinds[kind].removeprefix("mjWARN_") for kind in np.flatnonzero(counts[world])]
        path = self._dump(world)
        raise SimulationError(
            f"world {world} of {len(bad)} diverged ({', '.join(said) or 'not finite'}) "
            f"by step {self._calls}: see its last states in {path} and the model in {path.stem}.xml"
        )

    def _dump(self, world: int) -> Path:
        folder = self._folder
        if folder is None:
            folder = Path(tempfile.mkdtemp(prefix="riposte-diverged-"))
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"diverged-step{self._calls}-world{world}.npz"
        states = self._replay(world)
        time, qpos, qvel, act, warmstart, ctrl = (
            np.array([state[name] for state in states]) for name in _FIELDS
        )
        np.savez(
            path, time=time, qpos=qpos, qvel=qvel, act=act, qacc_warmstart=warmstart, ctrl=ctrl
        )
        path.with_suffix(".xml").write_text(self._xml(), encoding="utf-8")
        return path

    def _replay(self, world: int) -> list[dict[str, np.ndarray]]:
        """Return the world's last states, oldest first, the present one last."""
        data = mujoco.MjData(self._mj)
        mujoco.mj_setState(self._mj, data, self._starts[0, world], _WHOLE)
        states: list[dict[str, np.ndarray]] = []
        for call in range(int(self._started_at[0, world]), self._calls):
            data.ctrl[: self._ctrl.shape[1]] = self._ring[call % len(self._ring), world]
            states.append(_fields(data))
            mujoco.mj_step(self._mj, data, self._nstep)
        mujoco.mj_setState(self._mj, data, self._state[world], _WHOLE)
        return [*states[-DEPTH:], _fields(data)]


def _fields(data: mujoco.MjData) -> dict[str, np.ndarray]:
    return {name: np.array(getattr(data, name)) for name in _FIELDS}
