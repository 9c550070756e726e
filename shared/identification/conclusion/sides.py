"""Which side of the encoders a residual is from: the tracker against the logged joints says."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.conclusion.evidence import Replay, Sides
from shared.identification.dataset.types import Float64
from shared.identification.noise.blocks import block_means
from shared.identification.noise.floor import Noise
from shared.sim.plant.signals import pose_error

CLEAR = 1.5
"""A side is off from so many noise floors."""


@dataclass(frozen=True)
class Floors:
    """The noise, and what it is of."""

    noise: Noise
    block: float
    """Length of the means that the noise is of (s)."""


def sides_of(replays: Sequence[Replay], floors: Floors) -> Sides | None:
    """Return where what the base fit leaves is from; None without a tracker.

    Args:
        replays: with ``by_encoders`` where they have a tracker.
        floors: of joints and tracker.
    """
    noise = floors.noise
    if noise.tracker is None:
        return None
    joints: list[Float64] = []
    tracker: list[Float64] = []
    behind: list[Float64] = []
    for each in replays:
        if each.tracker_at is None or each.tracker is None or each.by_encoders is None:
            continue
        off = each.q - each.predicted["base_fit"]
        joints.append(block_means(each.at, off, floors.block))
        off = pose_error(each.tracker, each.tracked["base_fit"])
        tracker.append(block_means(each.tracker_at, off, floors.block))
        off = pose_error(each.tracker, each.by_encoders)
        behind.append(block_means(each.tracker_at, off, floors.block))
    if not joints:
        return None
    of_joints = float((_rms(joints) / noise.joints).max())
    of_tracker, of_behind = _rms(tracker), _rms(behind)
    in_noise = max(
        _length(of_behind[:3]) / _length(noise.tracker[:3]),
        _length(of_behind[3:]) / _length(noise.tracker[3:]),
    )
    return Sides(
        joints=of_joints,
        tracker=(_length(of_tracker[:3]), _length(of_tracker[3:])),
        behind=(_length(of_behind[:3]), _length(of_behind[3:])),
        behind_noise=in_noise,
        where=(
            ("both" if in_noise > CLEAR else "before the encoders")
            if of_joints > CLEAR
            else ("behind the encoders" if in_noise > CLEAR else "neither")
        ),
    )


def _rms(parts: Sequence[Float64]) -> Float64:
    """Return float64[D]; of what diverged only what came before counts."""
    return np.sqrt(np.nanmean(np.concatenate(parts) ** 2, axis=0))


def _length(axes: Float64) -> float:
    return float(np.sqrt(np.sum(axes**2)))
