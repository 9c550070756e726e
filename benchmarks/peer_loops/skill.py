"""How well an antagonist hits a player that holds still: the same measure for every loop.

Nothing here needs torch or a project's package, for it runs in the environments of all of them.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from shared.sim.bouts import Bouts
from shared.sim.task import Task

Act = Callable[[NDArray[np.float32]], NDArray[np.float32]]
"""float32[N, 27] of what is seen to float32[N, 6] of what is done."""

STATIC = "scripted:static"
BOUTS = 32
EVERY = 2
"""Updates between two measurements."""
MOST_UPDATES = 100
"""A loop that is not there by then has not learned it."""
_SEED = 7


def share_in_target(act: Act, bouts: int = BOUTS) -> float:
    """Return the share of all steps of whole bouts in which the bat was in the target.

    Args:
        act: plays the antagonist.
        bouts: how many; always the same.
    """
    generator = np.random.default_rng(_SEED)
    worlds = Bouts(Task(), "antagonist", STATIC, bouts)
    steps = worlds.env.rules.bout_steps
    inside, seen = 0, worlds.start(generator)
    for _ in range(steps):
        _, judged = worlds.step(act(seen), generator)
        inside += int(judged.antagonist_in_target.sum())
        seen = worlds.observe()
    return inside / (bouts * steps)
