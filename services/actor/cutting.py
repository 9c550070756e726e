"""Cuts what many worlds played into rollouts that a message has room for, world by world."""

import dataclasses
import itertools
import math

import numpy as np

from services.actor.collector import Segment
from shared.messages.topics import ROLLOUT
from shared.messages.training import ACTION_DIM, OBS_DIM

_A_ROW = 4 * (OBS_DIM + 2 * ACTION_DIM + 2)
"""Bytes of one step of one world: observation, action and its mean, its log density, reward."""
_A_WORLD = 8 + 4 + 4 * OBS_DIM + 1
"""Bytes of what a world has once: bout, first step, last observation, whether it ended."""
_HEADER = 64 * 1024
"""Bytes at most of everything else."""


def parts_of(steps: int, worlds: int) -> int:
    """Return how many rollouts so many steps of so many worlds have to be cut into.

    Raises:
        ValueError: not even the steps of one world fit.
    """
    room = ROLLOUT.max_bytes - _HEADER
    most = room // (steps * _A_ROW + _A_WORLD)
    if most == 0:
        raise ValueError(
            f"rollout_steps ({steps}) makes rollouts of over {room} B, too long for a message; "
            "choose fewer"
        )
    return math.ceil(worlds / most)


def cut(segment: Segment, parts: int) -> list[Segment]:
    """Return a segment cut into parts of as many worlds each, give or take one; without results.

    Args:
        segment: as collected.
        parts: how many; 1 gives the segment itself.
    """
    if parts == 1:
        return [segment]
    worlds = len(segment.bouts)
    edges = np.linspace(0, worlds, parts + 1).round().astype(int)
    return [
        dataclasses.replace(
            segment,
            bouts=segment.bouts[first:end],
            first_step=segment.first_step[first:end],
            obs=segment.obs[:, first:end],
            last_obs=segment.last_obs[first:end],
            actions=segment.actions[:, first:end],
            means=segment.means[:, first:end],
            log_probs=segment.log_probs[:, first:end],
            rewards=segment.rewards[:, first:end],
            truncated=segment.truncated[first:end],
            results=None,
        )
        for first, end in itertools.pairwise(edges)
    ]
