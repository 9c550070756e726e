"""The game as Gymnasium environments: one agent learns, the opponent is given.

``FencingSingleEnv`` is one bout, ``FencingVectorEnv`` many side by side in one batch of physics.
An episode is a bout; it ends by truncation, for nothing but the clock ends a bout.
"""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from shared.game.bout import Judgement
from shared.sim.bouts import Bouts
from shared.sim.render import SceneRenderer
from shared.sim.task import Float32s, Opponent, Side, Task

_FRAMES_PER_SECOND = 100


class FencingSingleEnv(gymnasium.Env[Float32s, Float32s]):
    """One bout at a time."""

    metadata: dict[str, Any] = {  # noqa: RUF012 (as the base class has it)
        "render_modes": ["rgb_array"],
        "render_fps": _FRAMES_PER_SECOND,
    }

    def __init__(
        self,
        agent: Side = "antagonist",
        opponent: Opponent = "scripted:static",
        task: Task | None = None,
        render_mode: str | None = None,
    ) -> None:
        """Build the bout.

        Args:
            agent: who learns.
            opponent: who plays the other side.
            task: the game; its defaults if None.
            render_mode: ``"rgb_array"`` to draw.

        Raises:
            ConfigError: if the model file cannot be used.
            SnapshotError: if there is no such opponent, or it does not fit this game.
        """
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'render_mode must be None or "rgb_array", got {render_mode!r}')
        task = task or Task()
        self._bouts = Bouts(task, agent, opponent, num_envs=1, num_threads=1)
        self._renderer: SceneRenderer | None = None
        self.render_mode = render_mode
        self.observation_space = task.observation_space()
        self.action_space = task.action_space()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32s, dict[str, Any]]:
        """Start a bout en garde; ``options`` are not used."""
        super().reset(seed=seed, options=options)
        self._bouts.env.reset(np.array([0]), self.np_random)
        return self._bouts.observe()[0], self._info(None)

    def step(self, action: Float32s) -> tuple[Float32s, float, bool, bool, dict[str, Any]]:
        """Carry out one control step of 10 ms."""
        env = self._bouts.env
        actions = np.asarray(action, np.float32)[None]
        paid, judgement = self._bouts.step(actions, self.np_random)
        truncated = bool(env.scores.finished()[0])
        obs = self._bouts.observe()[0]
        return obs, float(paid[0]), False, truncated, self._info(judgement)

    def render(self) -> NDArray[np.uint8] | None:  # type: ignore[override]
        """Return uint8[480, 854, 3], the bout as it is now.

        Raises:
            SimulationError: if this machine cannot draw.
        """
        if self.render_mode is None:
            return None
        env = self._bouts.env
        if self._renderer is None:
            self._renderer = SceneRenderer(env.model, 854, 480)
        return self._renderer.draw(env.batch.qpos[0])

    def close(self) -> None:
        """Give the renderer back."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _info(self, judgement: Judgement | None) -> dict[str, Any]:
        info: dict[str, Any] = {"score": float(self._bouts.env.scores.score[0])}
        if judgement is not None:
            info["antagonist_in_target"] = bool(judgement.antagonist_in_target[0])
            info["protagonist_in_target"] = bool(judgement.protagonist_in_target[0])
            info["contact"] = bool(judgement.contact[0])
        return info


class FencingVectorEnv(gymnasium.vector.VectorEnv[Float32s, Float32s, NDArray[Any]]):
    """Many bouts; a finished one starts anew in the same step, its end is in ``final_obs``."""

    metadata: dict[str, Any] = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012

    def __init__(
        self,
        num_envs: int,
        agent: Side = "antagonist",
        opponent: Opponent = "scripted:static",
        task: Task | None = None,
        num_threads: int = 1,
        staggered: bool = False,
    ) -> None:
        """Build the bouts.

        Args:
            num_envs: how many.
            agent: who learns.
            opponent: who plays the other side.
            task: the game; its defaults if None.
            num_threads: of the physics.
            staggered: the first bouts begin at different times of the clock, so that a batch
                never shows only one moment of the game.

        Raises:
            ConfigError: if the model file cannot be used.
            SnapshotError: if there is no such opponent, or it does not fit this game.
        """
        task = task or Task()
        self._bouts = Bouts(task, agent, opponent, num_envs, num_threads)
        self._staggered = staggered
        self.num_envs = num_envs
        observations, actions = task.observation_space(), task.action_space()
        self.single_observation_space, self.single_action_space = observations, actions
        self.observation_space = batch_space(observations, num_envs)
        self.action_space = batch_space(actions, num_envs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32s, dict[str, Any]]:
        """Start every bout; ``options`` are not used."""
        super().reset(seed=seed, options=options)
        return self._bouts.start(self.np_random, staggered=self._staggered), {}

    def step(
        self, actions: Float32s
    ) -> tuple[Float32s, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Carry out one control step of 10 ms in every bout."""
        turn = self._bouts.advance(np.asarray(actions, np.float32), self.np_random)
        info: dict[str, Any] = {}
        if turn.ended.any():
            final = np.full(self.num_envs, None, object)
            for world, seen in zip(np.flatnonzero(turn.ended), turn.last_seen, strict=True):
                final[world] = seen
            info["final_obs"], info["_final_obs"] = final, turn.ended
            info["final_info"] = {"score": turn.scores, "_score": turn.ended}
            info["_final_info"] = turn.ended
        return turn.obs, turn.paid, np.zeros(self.num_envs, np.bool_), turn.ended, info
