"""Samples one bout at a time for viewers: cheap, and never in the way of the rollouts."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from shared.clock import Clock
from shared.game.bout import Judgement
from shared.messages.live import BoutFrames
from shared.sim.env import FencingEnv

Float32s = NDArray[np.float32]

WORLD = 0
"""The world that viewers see."""


class FrameSampler:
    """Follows a bout of one world from its first step to its last, then pauses."""

    def __init__(self, env: FencingEnv, clock: Clock, period: float, every_steps: int) -> None:
        """Prepare.

        Args:
            env: the worlds.
            clock: measures the pause.
            period: seconds between the end of one bout shown and the start of the next; 0: never.
            every_steps: control steps between two frames.
        """
        self._env = env
        self._clock = clock
        self._period = period
        self._every = every_steps
        self._following = False
        self._not_before = clock.now()
        self._frames: list[tuple[int, Float32s, Float32s, Float32s]] = []
        self._marks: list[tuple[float, bool, bool, bool]] = []

    def watch(self, env: FencingEnv) -> None:
        """Forget the bout that was followed; from here on look at these worlds."""
        self.abandon()
        self._env = env

    def abandon(self) -> None:
        """Forget the bout that is being followed; its world starts something else."""
        self._following = False
        self._frames.clear()
        self._marks.clear()

    def on_step(self, verdict: Callable[[], Judgement]) -> None:
        """Look at the world after a control step.

        Args:
            verdict: gives the step's judgement; the score is up to date from then on.
        """
        step = int(self._env.scores.step[WORLD]) + self._env.unjudged
        if not self._following:
            if step != 1 or self._period <= 0.0 or self._clock.now() < self._not_before:
                return
            self._following = True
        if step % self._every == 0:
            judgement = verdict()
            positions, quaternions = self._env.batch.body_poses(WORLD)
            joints = self._env.batch.qpos[WORLD].astype(np.float32).reshape(2, 7)
            self._frames.append((step, positions, quaternions, joints))
            self._marks.append(
                (
                    float(self._env.scores.score[WORLD]),
                    bool(judgement.antagonist_in_target[WORLD]),
                    bool(judgement.protagonist_in_target[WORLD]),
                    bool(judgement.contact[WORLD]),
                )
            )
        if step >= self._env.rules.bout_steps:
            self._following = False
            self._not_before = self._clock.now() + self._period

    def take(
        self, actor: str, lease: str, bout: int, players: tuple[str, str]
    ) -> BoutFrames | None:
        """Return the frames gathered since the last call, or None.

        Args:
            actor: name of the process.
            lease: under which it is played.
            bout: number of the bout in the watched world.
            players: references of antagonist and protagonist.
        """
        if not self._frames:
            return None
        steps, positions, quaternions, joints = zip(*self._frames, strict=True)
        score, own, other, contact = zip(*self._marks, strict=True)
        self._frames.clear()
        self._marks.clear()
        return BoutFrames(
            actor=actor,
            lease=lease,
            bout=bout,
            antagonist=players[0],
            protagonist=players[1],
            model=self._env.model.hash,
            steps=np.asarray(steps, np.int32),
            positions=np.stack(positions),
            quaternions=np.stack(quaternions),
            joints=np.stack(joints),
            score=np.asarray(score, np.float32),
            in_target=np.asarray([own, other], np.bool_).T.copy(),
            contact=np.asarray(contact, np.bool_),
        )
