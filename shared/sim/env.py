"""N fencing bouts side by side: physics, observation, action, score; no learning, no bus.

The loop is dm_control's: the physics keeps the state, the task (rule book, encoder, decoder)
gives it a meaning, and this file steps both.
"""

import numpy as np
from numpy.typing import NDArray

from shared.game.bout import Judgement, Scoreboard
from shared.game.geometry import BatShape, Target
from shared.game.rules import RuleBook
from shared.messages.training import ACTION_DIM
from shared.policy.action import ActionConfig, bounded_offset, desired_pose
from shared.policy.observation import BAT_DIM, ObservationEncoder
from shared.policy.scripted.sight import Arena
from shared.sim.batch import FencingBatch
from shared.sim.model import FencingModel
from shared.sim.worlds import Worlds

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]
Longs = NDArray[np.int64]

_POSE_DIM = 7
_VELOCITY = slice(7, 10)
"""Linear velocity, among a bat's sensors."""
UNJUDGED_STEPS = 20
"""Most steps that may wait to be judged: enough to spread the cost of asking, and their arrays
stay in the cache."""
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
        worlds: Worlds | None = None,
    ) -> None:
        """Start the bouts.

        Args:
            model: the scene.
            rules: of the game.
            action: bounds of the offsets.
            num_envs: how many bouts.
            num_threads: of the physics.
            worlds: that many worlds of the model; MuJoCo's own, on the processor, if None.
        """
        self.model = model
        self.rules = rules
        self.num_envs = num_envs
        self.batch: Worlds = worlds or FencingBatch(model, num_envs, num_threads)
        x, y, z = (float(number) for number in model.target_centre)
        centre = (x, y, z)
        self.scores = Scoreboard(
            num_envs,
            rules,
            BatShape(model.bat_back, model.bat_front, model.bat_radius),
            Target(centre, model.target_radius),
        )
        self._action = action
        self._encoder = ObservationEncoder(centre, model.base_yaw)
        by_side = self.batch.sensors.reshape(num_envs, 2, -1)
        self._bats = by_side[:, :, :BAT_DIM]
        self._poses = by_side[:, :, :_POSE_DIM].transpose(2, 1, 0)
        self._tools = by_side[:, :, BAT_DIM:].transpose(1, 2, 0)
        self.bat_motion = (self._poses[:3], by_side[:, :, _VELOCITY].transpose(2, 1, 0))
        """Live views, float64[3, 2, N] each, antagonist first: where the bats' grips are in the
        world (m), and their velocities (m/s)."""
        self._played = np.empty((_POSE_DIM, 2, UNJUDGED_STEPS, num_envs))
        self.unjudged = 0
        """Steps played and not judged yet."""
        self._actions = np.empty((2, ACTION_DIM, num_envs))
        self._commands = self.batch.ctrl.reshape(num_envs, 2, _POSE_DIM).transpose(1, 2, 0)
        self.offset_scales = (1.0, 1.0)
        """How many times wider than configured each side's bounds are (``Player.offset_scale``)."""

    def others(self, num_envs: int) -> "FencingEnv":
        """Return so many other bouts of the same game, their worlds where these are."""
        worlds = self.batch.others(num_envs)
        return FencingEnv(self.model, self.rules, self._action, num_envs, worlds=worlds)

    @property
    def arena(self) -> Arena:
        """Return what a scripted player has to know of these worlds."""
        return Arena(
            bat=self.scores.bat,
            target_radius=self.scores.target.radius,
            offset_bound_m=self._action.offset_bound_m,
            offset_bound_rad=self._action.offset_bound_rad,
            control_timestep=self.model.cfg.control_timestep,
        )

    def observe(self, antagonist: Float32s, protagonist: Float32s) -> None:
        """Write what each side sees now.

        Args:
            antagonist: float32[N, 27], written.
            protagonist: float32[N, 27], written.
        """
        steps = self.scores.step + self.unjudged
        seconds: Floats = steps * np.float64(self.model.cfg.control_timestep)
        self._encoder.encode(self._bats, seconds, (antagonist, protagonist))

    def step(self, antagonist: Float32s, protagonist: Float32s) -> Judgement:
        """Carry out one control step in every bout and judge it.

        Args:
            antagonist: float32[N, 6], actions in units of their bounds, unclipped.
            protagonist: float32[N, 6].

        Raises:
            ValueError: if steps of ``advance`` have not been judged.
        """
        if self.unjudged:
            raise ValueError(f"{self.unjudged} steps are not judged yet: call judge() first")
        self._command(antagonist, protagonist)
        self.batch.step()
        poses = np.ascontiguousarray(self._poses)
        return self.scores.judge(poses[:3], poses[3:])

    def advance(self, antagonist: Float32s, protagonist: Float32s) -> None:
        """Carry out one control step in every bout, to be judged later with its successors.

        Args:
            antagonist: float32[N, 6], as for ``step``.
            protagonist: float32[N, 6].

        Raises:
            ValueError: if ``UNJUDGED_STEPS`` steps wait to be judged.
        """
        if self.unjudged == UNJUDGED_STEPS:
            raise ValueError(f"{self.unjudged} steps are not judged yet: call judge() first")
        self._command(antagonist, protagonist)
        self.batch.step()
        self._played[:, :, self.unjudged] = self._poses
        self.unjudged += 1

    def judge(self) -> Judgement:
        """Judge all steps since the last time, K of them; see ``Scoreboard.judge_steps``."""
        played = np.ascontiguousarray(self._played[:, :, : self.unjudged])
        self.unjudged = 0
        return self.scores.judge_steps(played[:3], played[3:])

    def _command(self, antagonist: Float32s, protagonist: Float32s) -> None:
        """Turn actions into the poses that the servos are to reach."""
        self._actions[0] = antagonist.T
        self._actions[1] = protagonist.T
        offsets = bounded_offset(self._actions, self._action)
        if self.offset_scales != (1.0, 1.0):
            offsets *= np.array(self.offset_scales)[:, None, None]
        self._commands[:] = desired_pose(offsets, self._tools)

    def reset(
        self, bouts: Longs, generator: np.random.Generator, first_step: NDArray[np.int32] | int = 0
    ) -> None:
        """Start bouts anew from the en-garde pose with noise.

        Args:
            bouts: int64[K], which.
            generator: draws the noise.
            first_step: steps that count as already gone (staggered starts).
        """
        self.unjudged = 0
        noise = generator.uniform(-START_NOISE_RAD, START_NOISE_RAD, (len(bouts), 14))
        self.batch.reset(bouts, self.model.en_garde.reshape(-1) + noise)
        self.scores.reset(bouts, first_step)

    def finished(self) -> Longs:
        """Return int64[K], the bouts that have run their full time."""
        return np.flatnonzero(self.scores.finished())
