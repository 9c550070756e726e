"""What the pictures of a report show, computed from the evidence: pure functions of arrays."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shared.identification.conclusion.diagnose import diagnose
from shared.identification.conclusion.evidence import STAGES, Diagnostics, Evidence, Replay, Stage
from shared.identification.dataset.types import Float64
from shared.identification.verdict import Verdict

WINDOW = 5.0
"""Of a motion that is shown (s)."""
LOUD = 1.0
"""Over which a residual is averaged to find where it is largest (s)."""
SEGMENT = 0.25
"""Of a time line (s)."""


@dataclass(frozen=True)
class Window:
    """Where in the data a picture looks."""

    replay: Replay
    joint: int
    rows: slice

    @property
    def at(self) -> Float64:
        """Return float64[T] (s)."""
        return self.replay.at[self.rows]


def stages_of(verdict: Verdict) -> tuple[Stage, ...]:
    """Return the stages that differ: without cause or tie the extended model is the base fit."""
    return STAGES if verdict.causes or verdict.ties else STAGES[:2]


def shown(evidence: Evidence) -> tuple[Replay, ...]:
    """Return the held-out trajectories, or all of them where nothing was held out."""
    return evidence.held_out or evidence.replays


def residual(replay: Replay, stage: Stage) -> Float64:
    """Return float64[T, J], measured minus predicted (rad, m)."""
    return replay.q - replay.predicted[stage]


def rms_by_joint(replays: Sequence[Replay], stage: Stage) -> Float64:
    """Return float64[J], root-mean-square residuals (rad, m); infinite where a replay diverged."""
    squares = np.concatenate([residual(replay, stage) ** 2 for replay in replays])
    squares[~np.isfinite(squares)] = np.inf
    return np.sqrt(squares.mean(axis=0))


def worst_joint(verdict: Verdict, evidence: Evidence) -> int:
    """Return the joint that a named cause sits at, else the one furthest off its noise floor."""
    for cause in verdict.causes:
        if cause.where in evidence.joints:
            return evidence.joints.index(cause.where)
    off = rms_by_joint(shown(evidence), "base_fit") / evidence.noise
    return int(np.argmax(off))


def window_of(evidence: Evidence, joint: int) -> Window:
    """Return the stretch of held-out motion about where the base fit is furthest off at a joint."""
    best, found = -1.0, None
    for replay in shown(evidence):
        off = residual(replay, "base_fit")[:, joint] ** 2
        total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(off, posinf=0.0, neginf=0.0))])
        begins = np.searchsorted(replay.at, replay.at - 0.5 * LOUD)
        ends = np.searchsorted(replay.at, replay.at + 0.5 * LOUD, "right")
        mean = (total[ends] - total[begins]) / np.maximum(ends - begins, 1)
        pick = int(np.argmax(mean))
        if mean[pick] > best:
            latest = max(replay.at[0], replay.at[-1] - WINDOW)
            begin = float(np.clip(replay.at[pick] - 0.5 * WINDOW, replay.at[0], latest))
            rows = np.searchsorted(replay.at, [begin, begin + WINDOW + 1e-9])
            best, found = (
                float(mean[pick]),
                Window(replay, joint, slice(int(rows[0]), int(rows[1]))),
            )
    assert found is not None  # a data set has a trajectory
    return found


def diagnostics_after(evidence: Evidence) -> Diagnostics:
    """Return how the residual of the extended model looks, in the words of the base fit's."""
    replays = [
        dataclasses.replace(
            replay,
            predicted={**replay.predicted, "base_fit": replay.predicted["extended"]},
            tracked=(
                {**replay.tracked, "base_fit": replay.tracked["extended"]}
                if "extended" in replay.tracked
                else replay.tracked
            ),
        )
        for replay in evidence.replays
    ]
    return diagnose(replays, evidence.joints, evidence.units)


def clearest_profile(before: Diagnostics, after: Diagnostics, joint: int) -> int:
    """Return the number of the profile that the causes flattened most at a joint."""
    flattened = [
        _mean_square(one.mean[joint]) - _mean_square(other.mean[joint])
        for one, other in zip(before.profiles, after.profiles, strict=True)
    ]
    return int(np.argmax(flattened))


def lane(evidence: Evidence, replay: Replay) -> tuple[Float64, Float64]:
    """Return edges (s) and what the extended model leaves over, in units of the noise floor.

    Returns:
        float64[B + 1] and float64[B], the largest of the joints' root mean squares.
    """
    off = np.nan_to_num(residual(replay, "extended") / evidence.noise, nan=99.0)
    count = max(1, round((replay.at[-1] - replay.at[0]) / SEGMENT))
    edges: Float64 = np.linspace(replay.at[0], replay.at[-1], count + 1, dtype=np.float64)
    place = np.clip(np.searchsorted(edges, replay.at, "right") - 1, 0, count - 1)
    rows = np.maximum(np.bincount(place, minlength=count), 1)
    square = np.stack(
        [np.bincount(place, off[:, joint] ** 2, count) / rows for joint in range(off.shape[1])]
    )
    return edges, np.sqrt(square.max(axis=0))


def tracker_off(replay: Replay) -> dict[Stage, Float64]:
    """Return float64[K] by stage, how far the tracker is from where it was predicted (m)."""
    if replay.tracker is None:
        return {}
    measured = replay.tracker[:, :3]
    return {
        stage: np.linalg.norm(measured - replay.tracked[stage][:, :3], axis=1)
        for stage in STAGES
        if stage in replay.tracked
    }


def _mean_square(values: Float64) -> float:
    good = values[np.isfinite(values)]
    return float((good**2).mean()) if len(good) else 0.0
