"""N fencing bouts side by side: physics, observation, action, score; no learning, no bus.

The loop is dm_control's: the physics keeps the state, the task (rule book, encoder, decoder)
gives it a meaning, and this file steps both.
"""

import numpy as np
from numpy.typing import NDArray

from shared.game.bout import Judgement, Scoreboard
from shared.game.geometry import BatShape, Target
from shared.game.rules import RuleBook
from shared.messages.training import OBS_DIM
from shared.policy.action import ActionConfig, bounded_offset, desired_pose
from shared.policy.observation import BAT_DIM, ObservationEncoder
from shared.sim.batch import FencingBatch
from shared.sim.model import FencingModel

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]
Longs = NDArray[np.int64]

SIDES = (0, 1)
"""Antagonist, protagonist: the order of every per-side axis."""
_AGENT_SENSORS = 20
_POSE_DIM = 7
START_NOISE_RAD = 0.1
"""Uniform noise on each joint of the en-garde pose."""


class FencingEnv:
    """N bouts; bouts never end by themselves: look at ``finished`` and ``reset`` those."""

    def __init__(
        self,
        model: FencingModel,
        rules: RuleBook,
        action: ActionConfig,
        num_envs: int,
        num_threads: int = 1,
    ) -> None:
        self.model = model
        self.rules = rules
        self.num_envs = num_envs
        self.batch = FencingBatch(model, num_envs, num_threads)
        centre = tuple(float(x) for x in model.target_centre)
        self.scores = Scoreboard(
            num_envs,
            rules,
            BatShape(model.bat_back, model.bat_front, model.bat_radius),
            Target(centre, model.target_radius),
        )
        self._action = action
        self._encoders = [ObservationEncoder(centre, float(yaw)) for yaw in model.base_yaw]
        sensors = self.batch.sensors
        self._bats = [sensors[:, s * _AGENT_SENSORS :][:, :BAT_DIM] for s in SIDES]
        self._tools = [sensors[:, s * _AGENT_SENSORS + BAT_DIM :][:, :_POSE_DIM] for s in SIDES]
        self._commands = [self.batch.ctrl[:, s * _POSE_DIM :][:, :_POSE_DIM] for s in SIDES]
        by_side = sensors.reshape(num_envs, 2, _AGENT_SENSORS).transpose(1, 0, 2)
        self._grips = by_side[:, :, 0:3]
        self._orientations = by_side[:, :, 3:7]

    def observe(self, side: int, out: Float32s | None = None) -> Float32s:
        """Return what one side sees now.

        Args:
            side: 0 antagonist, 1 protagonist.
            out: float32[N, 27] to write into; a new array without it.

        Returns:
            float32[N, 27].
        """
        if out is None:
            out = np.empty((self.num_envs, OBS_DIM), np.float32)
        seconds = self.scores.step * self.model.cfg.control_timestep
        return self._encoders[side].encode(self._bats[side], self._bats[1 - side], seconds, out)

    def step(self, antagonist: Float32s, protagonist: Float32s) -> Judgement:
        """Carry out one control step in every bout and judge it.

        Args:
            antagonist: float32[N, 6], actions in units of their bounds, unclipped.
            protagonist: float32[N, 6].
        """
        for side, actions in enumerate((antagonist, protagonist)):
            offsets = bounded_offset(actions, self._action)
            desired_pose(offsets, self._tools[side], self._commands[side])
        self.batch.step()
        return self.scores.judge(self._grips, self._orientations)

    def reset(
        self, bouts: Longs, generator: np.random.Generator, first_step: NDArray[np.int32] | int = 0
    ) -> None:
        """Start bouts anew from the en-garde pose with noise.

        Args:
            bouts: int64[K], which.
            generator: draws the noise.
            first_step: steps that count as already gone (staggered starts).
        """
        noise = generator.uniform(-START_NOISE_RAD, START_NOISE_RAD, (len(bouts), 14))
        self.batch.reset(bouts, self.model.en_garde.reshape(-1) + noise)
        self.scores.reset(bouts, first_step)

    def finished(self) -> Longs:
        """Return int64[K], the bouts that have run their full time."""
        return np.flatnonzero(self.scores.finished())
