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

    @property
    def steps(self) -> int:
        """Return the control steps of one rollout."""
        return self.batch_samples // self.num_envs

    def batch(self, num_envs: int = 0, seed: int = 0) -> "Batch":
        """Return the bouts.

        Args:
            num_envs: how many; all of them by default.
            seed: of their beginnings.
        """
        bouts = Bouts(Task(), "antagonist", Path(self.opponent), num_envs or self.num_envs)
        return Batch(bouts, seed)


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


class Stopwatch:
    """Opens the window after the warm-up and says when it is over."""

    def __init__(self, work: Work) -> None:
        self._work = work
        self._me = psutil.Process()
        self._updates = 0
        self._first_update_s = 0.0
        self._begin = (0, 0, 0.0, 0.0)
        self._resident = 0.0

    def update_done(self, samples: int) -> bool:
        """Note the end of an update; return whether the window is over.

        Args:
            samples: learned from since the start.
        """
        now = time.monotonic()
        self._updates += 1
        if self._updates == 1:
            self._first_update_s = time.time() - self._me.create_time()  # noqa: TID251
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

    def _all(self) -> list[psutil.Process]:
        return [self._me, *self._me.children(recursive=True)]

    def _cpu(self) -> float:
        """Return CPU seconds; children that ended are in their parents' books."""
        total = 0.0
        for one in self._all():
            times = one.cpu_times()
            total += times.user + times.system + times.children_user + times.children_system
        return total


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
