"""The work that every loop is given, and how it is timed: the same for ours and for theirs.

Nothing here needs torch or a project's package, for it runs in the environments of all of them.
"""

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

from shared.runtime.process import THREAD_LIMITS

os.environ.update(THREAD_LIMITS)

import msgspec
import numpy as np
import psutil
from numpy.typing import NDArray

from benchmarks.peer_loops.skill import EVERY, MOST_UPDATES, Act, share_in_target
from shared.messages.training import ACTION_DIM, OBS_DIM
from shared.sim.bouts import Bouts, Turn
from shared.sim.task import Task

INPUTS, OUTPUTS = OBS_DIM, ACTION_DIM
WARM_UP = 2
"""Updates before the clock starts."""


class Work(msgspec.Struct, frozen=True, kw_only=True):
    """Antagonists that learn by PPO against a frozen fresh protagonist."""

    opponent: str
    """File of its snapshot."""
    num_envs: int
    """Bouts side by side, over all processes of a loop."""
    batch_samples: int
    """Of one update."""
    hidden_dims: tuple[int, ...]
    epochs: int
    minibatches: int
    learning_rate: float
    gamma: float
    gae_lambda: float
    clip: float
    entropy_coef: float
    value_loss_coef: float
    max_grad_norm: float
    initial_std: float
    mode: str = ""
    """Which of a project's own ways to run."""
    seconds: float = 25.0
    """Length of the window."""
    threads: int = 1
    """Of torch, where the loop is one process."""
    seed: int = 1
    physics_threads: int = 1
    """Of the simulator."""
    score_weight: float = 1.0
    shaping_weight: float = 1.0
    """Factors of the game score and of the continuous part in the reward."""
    skill: float = 0.0
    """Share of the steps in the target at which the loop ends; 0: at the end of the window."""
    spawned_at: float = 0.0
    """When its process was started (s, wall clock)."""

    @property
    def steps(self) -> int:
        """Return the control steps of one rollout."""
        return self.batch_samples // self.num_envs

    def batch(self, num_envs: int = 0, seed: int | None = None) -> "Batch":
        """Return the bouts.

        Args:
            num_envs: how many; all of them by default.
            seed: of their beginnings; the work's by default.
        """
        task = Task(score_weight=self.score_weight, shaping_weight=self.shaping_weight)
        bouts = Bouts(
            task, "antagonist", Path(self.opponent), num_envs or self.num_envs, self.physics_threads
        )
        return Batch(bouts, self.seed if seed is None else seed)

    def stopwatch(self) -> "Stopwatch":
        """Return what says when the loop is over."""
        return Race(self) if self.skill else Stopwatch(self)


class Batch:
    """Bouts side by side, begun at different times of the clock."""

    def __init__(self, bouts: Bouts, seed: int) -> None:
        self._bouts = bouts
        self._generator = np.random.default_rng(seed)

    def reset(self) -> NDArray[np.float32]:
        """Start every bout; return float32[N, 27], what the antagonists see."""
        return self._bouts.start(self._generator, staggered=True)

    def step(self, actions: NDArray[np.float32]) -> Turn:
        """Play one control step of every bout; ended ones begin anew.

        Args:
            actions: float32[N, 6] in [-1, 1].
        """
        return self._bouts.advance(actions, self._generator)


class Timing(msgspec.Struct, frozen=True, kw_only=True):
    """What a loop did between two ends of an update."""

    samples: int
    updates: int
    wall_s: float
    cpu_s: float
    """Of the process and all its children."""
    first_update_s: float
    """From the start of the process."""
    resident_mib: float
    """Of the process and all its children; memory that they share counts in each."""
    skill: float = 0.0
    """Share of the steps in the target, as it was measured last."""


class Stopwatch:
    """Opens the window after the warm-up and says when it is over."""

    def __init__(self, work: Work) -> None:
        self._work = work
        self._me = psutil.Process()
        self._updates = 0
        self._first_update_s = 0.0
        self._begin = (0, 0, 0.0, 0.0)
        self._resident = 0.0

    def update_done(self, samples: int, act: Act | None = None) -> bool:
        """Note the end of an update; return whether the loop is over.

        Args:
            samples: learned from since the start.
            act: plays float32[N, 27] as the policy now would, without noise.
        """
        del act
        now = time.monotonic()
        self._count()
        if self._updates <= WARM_UP:
            self._begin = (samples, self._updates, now, self._cpu())
            return False
        return now - self._begin[2] >= self._work.seconds

    def timing(self, samples: int) -> Timing:
        """Return the window, which ends now."""
        first, updates, began, cpu = self._begin
        return Timing(
            samples=samples - first,
            updates=self._updates - updates,
            wall_s=time.monotonic() - began,
            cpu_s=self._cpu() - cpu,
            first_update_s=self._first_update_s,
            resident_mib=sum(one.memory_info().rss for one in self._all()) / 2**20,
        )

    def _count(self) -> None:
        self._updates += 1
        if self._updates == 1:
            self._first_update_s = self._age()

    def _age(self) -> float:
        """Return the seconds since the process was started."""
        return time.time() - self._work.spawned_at  # noqa: TID251

    def _all(self) -> list[psutil.Process]:
        return [self._me, *self._me.children(recursive=True)]

    def _cpu(self) -> float:
        """Return CPU seconds; children that ended are in their parents' books."""
        total = 0.0
        for one in self._all():
            times = one.cpu_times()
            total += times.user + times.system + times.children_user + times.children_system
        return total


class Race(Stopwatch):
    """Runs from the start of the process to a skill, and stands still while that is measured."""

    def __init__(self, work: Work) -> None:
        super().__init__(work)
        self._measuring_s = self._measuring_cpu_s = self._skill = 0.0

    def update_done(self, samples: int, act: Act | None = None) -> bool:
        """Note the end of an update, measure after some; return whether the skill is there.

        It gives up after ``MOST_UPDATES``.
        """
        self._count()
        if self._updates % EVERY:
            return False
        if act is None:
            raise ValueError("this loop does not say how its policy plays: it cannot race")
        began, cpu = time.monotonic(), self._cpu()
        self._skill = share_in_target(act)
        self._measuring_s += time.monotonic() - began
        self._measuring_cpu_s += self._cpu() - cpu
        return self._skill >= self._work.skill or self._updates >= MOST_UPDATES

    def timing(self, samples: int) -> Timing:
        """Return the race, which ends now."""
        return Timing(
            samples=samples,
            updates=self._updates,
            wall_s=self._age() - self._measuring_s,
            cpu_s=self._cpu() - self._measuring_cpu_s,
            first_update_s=self._first_update_s,
            resident_mib=sum(one.memory_info().rss for one in self._all()) / 2**20,
            skill=self._skill,
        )


def main(loop: Callable[[Work], Timing]) -> None:
    """Run a loop on the work that the command line names, and print its timing as JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("work", help="JSON")
    work = msgspec.json.decode(parser.parse_args().work, type=Work)
    say(loop(work))


def say(timing: Timing) -> None:
    """Print a timing as the last line."""
    sys.stdout.write("\n" + msgspec.json.encode(timing).decode() + "\n")
    sys.stdout.flush()
