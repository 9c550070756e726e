"""The game as a PettingZoo parallel environment: both agents act, nobody is given."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from shared.game.reward import reward
from shared.sim.render import SceneRenderer
from shared.sim.task import SIDES, Float32s, Side, Task, observe

_FRAMES_PER_SECOND = 100


class FencingParallelEnv(ParallelEnv[Side, Float32s, Float32s]):
    """One bout between two agents; it ends by truncation, for nothing but the clock ends it."""

    metadata: dict[str, Any] = {  # noqa: RUF012 (as the base class has it)
        "name": "riposte_fencing_v0",
        "render_modes": ["rgb_array"],
        "render_fps": _FRAMES_PER_SECOND,
        "is_parallelizable": True,
    }

    def __init__(self, task: Task | None = None, render_mode: str | None = None) -> None:
        """Build the bout.

        Args:
            task: the game; its defaults if None.
            render_mode: ``"rgb_array"`` to draw.

        Raises:
            ConfigError: if the model file cannot be used.
        """
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'render_mode must be None or "rgb_array", got {render_mode!r}')
        self._task = task or Task()
        self._env = self._task.worlds(num_envs=1)
        self._generator, _ = seeding.np_random()
        self._renderer: SceneRenderer | None = None
        self.render_mode = render_mode
        self.possible_agents: list[Side] = list(SIDES)
        self.agents: list[Side] = []
        self.observation_spaces: dict[Side, gymnasium.Space[Float32s]] = {
            side: self._task.observation_space() for side in SIDES
        }
        self.action_spaces: dict[Side, gymnasium.Space[Float32s]] = {
            side: self._task.action_space() for side in SIDES
        }

    def observation_space(self, agent: Side) -> gymnasium.Space[Float32s]:
        """Return the agent's observation space, always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: Side) -> gymnasium.Space[Float32s]:
        """Return the agent's action space, always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[Side, Float32s], dict[Side, dict[str, Any]]]:
        """Start a bout en garde; ``options`` are not used."""
        if seed is not None:
            self._generator, _ = seeding.np_random(seed)
        self.agents = list(SIDES)
        self._env.reset(np.array([0]), self._generator)
        return self._observe(), {side: {} for side in SIDES}

    def step(
        self, actions: dict[Side, Float32s]
    ) -> tuple[
        dict[Side, Float32s],
        dict[Side, float],
        dict[Side, bool],
        dict[Side, bool],
        dict[Side, dict[str, Any]],
    ]:
        """Carry out one control step of 10 ms."""
        antagonist, protagonist = (np.asarray(actions[s], np.float32)[None] for s in SIDES)
        judgement = self._env.step(antagonist, protagonist)
        task, over = self._task, bool(self._env.scores.finished()[0])
        rewards: dict[Side, float] = {
            side: float(
                reward(i, judgement, task.score_weight, task.shaping_weight, task.reward)[0]
            )
            for i, side in enumerate(SIDES)
        }
        if over:
            self._env.batch.check()
            self.agents = []
        score = float(self._env.scores.score[0])
        return (
            self._observe(),
            rewards,
            dict.fromkeys(SIDES, False),
            dict.fromkeys(SIDES, over),
            {side: {"score": score} for side in SIDES},
        )

    def render(self) -> NDArray[np.uint8] | None:
        """Return uint8[480, 854, 3], the bout as it is now.

        Raises:
            SimulationError: if this machine cannot draw.
        """
        if self.render_mode is None:
            return None
        if self._renderer is None:
            self._renderer = SceneRenderer(self._env.model, 854, 480)
        return self._renderer.draw(self._env.batch.qpos[0])

    def close(self) -> None:
        """Give the renderer back."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _observe(self) -> dict[Side, Float32s]:
        return {side: seen[0] for side, seen in zip(SIDES, observe(self._env), strict=True)}
