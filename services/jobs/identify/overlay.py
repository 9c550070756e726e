"""Puts what was measured and what is simulated on one time line, for the Rerun recording."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from services.jobs.identify.residuals import rms_by_joint, shown, stages_of, tracker_off
from services.jobs.identify.words import cause_text, unexplained_text
from shared.identification.arm.subject import plant_of
from shared.identification.conclusion.evidence import Evidence, Replay
from shared.identification.dataset.types import Dataset, Float64
from shared.identification.verdict import Verdict
from shared.sim.plant.looks import Looks
from shared.telemetry.identification_recording import (
    Curves,
    Overlay,
    Poses,
    Span,
    write_overlay_recording,
)
from shared.telemetry.wording import THOUSANDTHS

PAUSE = 1.0
"""Between two trajectories (s)."""
POSES_HZ = 30.0
"""Of the arms; curves have every row."""


def write_overlay(path: Path, dataset: Dataset, verdict: Verdict, evidence: Evidence) -> None:
    """Write the recording of a finding.

    Raises:
        RiposteError: it cannot be written.
    """
    name = dataset.folder.resolve().name
    looks = Looks(plant_of(dataset))
    write_overlay_recording(path, overlay_of(name, looks, verdict, evidence))


def overlay_of(name: str, looks: Looks, verdict: Verdict, evidence: Evidence) -> Overlay:
    """Return everything of a recording, trajectories end to end, held-out ones first."""
    held_out = {replay.name for replay in evidence.held_out}
    replays = sorted(evidence.replays, key=lambda replay: replay.name not in held_out)
    begins = _begins(replays)
    starts = dict(zip((replay.name for replay in replays), begins, strict=True))
    spans = [
        Span(f"{replay.name} ({replay.split})", begin, begin + _length(replay))
        for replay, begin in zip(replays, begins, strict=True)
    ]
    left = [
        Span(each.where or "unexplained", starts[each.trajectory] + each.begin,
             starts[each.trajectory] + each.end)
        for each in verdict.unexplained
        if each.trajectory in starts
    ]  # fmt: skip
    arms = {"measured": _poses(looks, replays, begins, [replay.q for replay in replays])}
    for stage in stages_of(verdict)[1:]:
        predicted = [_held(replay.predicted[stage]) for replay in replays]
        arms[stage] = _poses(looks, replays, begins, predicted)
    return Overlay(
        name=name,
        bodies=looks.bodies,
        solids=looks.solids,
        arms=arms,
        curves=[*_joints(verdict, evidence, replays, begins), *_tracker(verdict, replays, begins)],
        trajectories=spans,
        unexplained=left,
        markdown=_markdown(verdict),
    )


def _begins(replays: Sequence[Replay]) -> list[float]:
    begins: list[float] = []
    at = 0.0
    for replay in replays:
        begins.append(at)
        at += _length(replay) + PAUSE
    return begins


def _length(replay: Replay) -> float:
    return float(replay.at[-1])


def _held(q: Float64) -> Float64:
    """Return joints that stay where they last were known from where a simulation diverged."""
    bad = np.flatnonzero(~np.isfinite(q).all(axis=1))
    if not len(bad):
        return q
    out = q.copy()
    out[bad[0] :] = q[bad[0] - 1] if bad[0] else 0.0
    return out


def _poses(
    looks: Looks, replays: Sequence[Replay], begins: Sequence[float], joints: Sequence[Float64]
) -> Poses:
    at: list[Float64] = []
    picked: list[Float64] = []
    for replay, begin, q in zip(replays, begins, joints, strict=True):
        instants: Float64 = np.arange(replay.at[0], replay.at[-1], 1.0 / POSES_HZ, dtype=np.float64)
        rows = np.minimum(np.searchsorted(replay.at, instants), len(replay.at) - 1)
        at.append(begin + replay.at[rows])
        picked.append(q[rows])
    positions, quaternions = looks.poses(np.concatenate(picked))
    return Poses(np.concatenate(at), positions, quaternions)


def _joints(
    verdict: Verdict, evidence: Evidence, replays: Sequence[Replay], begins: Sequence[float]
) -> list[Curves]:
    """Return the curves of each joint, furthest off first."""
    stages = stages_of(verdict)
    at = _line(replays, begins, [replay.at for replay in replays])
    off = np.nan_to_num(rms_by_joint(shown(evidence), "base_fit") / evidence.noise, posinf=1e9)
    curves: list[Curves] = []
    order: list[int] = np.argsort(-off).tolist()
    for joint in order:
        measured = _joined([replay.q[:, joint] for replay in replays])
        motion: dict[str, Float64] = {"measured": measured}
        residual: dict[str, Float64] = {}
        for stage in stages:
            predicted = _joined([replay.predicted[stage][:, joint] for replay in replays])
            motion[stage] = predicted
            residual[stage] = 1e3 * (measured - predicted)
        unit = evidence.units[joint]
        units = (unit, THOUSANDTHS[unit])
        curves.append(Curves(evidence.joints[joint], units, at, motion, residual))
    return curves


def _tracker(verdict: Verdict, replays: Sequence[Replay], begins: Sequence[float]) -> list[Curves]:
    tracked = [
        (replay, begin)
        for replay, begin in zip(replays, begins, strict=True)
        if replay.tracker_at is not None and tracker_off(replay)
    ]
    if not tracked:
        return []
    known = [replay for replay, _ in tracked]
    times = [replay.tracker_at for replay in known if replay.tracker_at is not None]
    at = _line(known, [begin for _, begin in tracked], times)
    stages = stages_of(verdict)
    off = [tracker_off(replay) for replay in known]
    residual = {
        str(stage): 1e3 * _joined([each[stage] for each in off])
        for stage in stages
        if all(stage in each for each in off)
    }
    return [Curves("tracker", ("m", "mm"), at, {}, residual)]


def _line(replays: Sequence[Replay], begins: Sequence[float], times: Sequence[Float64]) -> Float64:
    """Return instants end to end, with one after each trajectory at which curves break."""
    return np.concatenate(
        [
            np.append(begin + at, begin + max(float(at[-1]), _length(replay)) + 1e-3)
            for replay, begin, at in zip(replays, begins, times, strict=True)
        ]
    )


def _joined(columns: Sequence[Float64]) -> Float64:
    return np.concatenate([np.append(column, np.nan) for column in columns])


def _markdown(verdict: Verdict) -> str:
    lines = [verdict.sentence, ""]
    lines += [f"- {cause_text(cause)}" for cause in verdict.causes]
    left_over = (unexplained_text(left, verdict.held_out) for left in verdict.unexplained)
    lines += [f"- left over: {text}" for text in left_over]
    lines += [
        "",
        "Solid or black: measured. Grey: nominal. Orange: base fit. Blue: extended.",
        "Held-out recordings come first.",
    ]
    return "\n".join(lines)
