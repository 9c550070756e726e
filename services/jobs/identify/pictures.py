"""The pictures of a report, drawn from verdict and evidence."""

from dataclasses import dataclass

import numpy as np

from services.jobs.identify.residuals import (
    Window,
    clearest_profile,
    diagnostics_after,
    lane,
    residual,
    rms_by_joint,
    shown,
    stages_of,
    tracker_off,
    window_of,
    worst_joint,
)
from services.jobs.identify.words import floor_name, floor_text, unexplained_mark
from shared.identification.conclusion.evidence import Diagnostics, Evidence
from shared.identification.dataset.types import Float64
from shared.identification.verdict import BaseValue, Scored, Verdict
from shared.telemetry import identification_diagnostics as diagnostic
from shared.telemetry import identification_figures as figures
from shared.telemetry.identification_diagnostics import Line, Row
from shared.telemetry.wording import THOUSANDTHS

MOST_JOINTS = 4
"""In a diagnostic."""
MOST_CANDIDATES = 12
"""Refitted ones in the picture; the table has all."""
MOST_OTHERS = 3
MOST_PARAMETERS = 16
MOST_LANES = 10
AXES = {
    "velocity": "speed of the joint",
    "position": "position of the joint",
    "effort": "torque on the joint",
    "time": "time since the start",
}
"""Of profiles."""


@dataclass(frozen=True)
class Picture:
    """A figure and what it shows."""

    svg: str
    caption: str


def stages(verdict: Verdict) -> Picture:
    """Return how far off each stage is."""
    held_out = verdict.held_out
    values = {"nominal": held_out.nominal, "base_fit": held_out.base_fit}
    if "extended" in stages_of(verdict):
        values["extended"] = held_out.extended
    best = "A right model leaves about 1" if held_out.is_floor_measured else floor_text(held_out)
    words = f"Root-mean-square residual on motion that nothing was fitted to. {best}."
    return Picture(figures.stages_against_noise(values, floor_name(held_out)), words)


def by_joint(verdict: Verdict, evidence: Evidence) -> Picture:
    """Return the residual of each joint by stage."""
    replays = shown(evidence)
    found = {stage: 1e3 * rms_by_joint(replays, stage) for stage in stages_of(verdict)}
    finite = {stage: np.where(np.isfinite(v), v, np.nan) for stage, v in found.items()}
    svg = figures.residuals_by_joint(
        evidence.joints, finite, 1e3 * evidence.noise, small_unit(evidence)
    )
    floor = (
        "its noise floor, from repeats"
        if evidence.noise_from_repeats
        else "what the base fit usually leaves there, for want of repeats"
    )
    return Picture(svg, f"Each joint, before and after. The tick is {floor}.")


def shown_window(verdict: Verdict, evidence: Evidence) -> Window:
    """Return the stretch that the pictures of motion show."""
    return window_of(evidence, worst_joint(verdict, evidence))


def motion(window: Window, verdict: Verdict, evidence: Evidence) -> Picture:
    """Return a stretch of one joint: measured, and what each stage predicts."""
    joint, unit = evidence.joints[window.joint], evidence.units[window.joint]
    predicted = {
        str(stage): window.replay.predicted[stage][window.rows, window.joint]
        for stage in stages_of(verdict)
    }
    measured = window.replay.q[window.rows, window.joint]
    svg = figures.motion(window.at, measured, predicted, f"{figures.plain(joint)} ({unit})")
    return Picture(svg, f"The same stretch of {joint}: what was measured and what each stage says.")


def left_over(window: Window, verdict: Verdict, evidence: Evidence) -> Picture:
    """Return what each stage leaves over in the same stretch."""
    index = window.joint
    small = THOUSANDTHS[evidence.units[index]]
    residuals = {
        str(stage): 1e3 * residual(window.replay, stage)[window.rows, index]
        for stage in stages_of(verdict)[1:]
    }
    svg = figures.residual_over_time(
        window.at, residuals, 1e3 * float(evidence.noise[index]),
        f"{figures.plain(evidence.joints[index])} ({small})",
    )  # fmt: skip
    words = (
        f"Measured minus predicted of {evidence.joints[index]} in {window.replay.name}, where the "
        f"base fit is furthest off; the grey band is twice {floor_name(verdict.held_out)}."
    )
    return Picture(svg, words)


def tracker(window: Window, verdict: Verdict, evidence: Evidence) -> Picture | None:
    """Return how far the tracker is from where it was predicted, None without one."""
    off, at = tracker_off(window.replay), window.replay.tracker_at
    if not off or at is None:
        return None
    inside = (at >= window.at[0]) & (at <= window.at[-1])
    noise = None if evidence.tracker_noise is None else 1e3 * evidence.tracker_noise[0]
    stages = stages_of(verdict)
    residuals = {str(k): 1e3 * values[inside] for k, values in off.items() if k in stages}
    svg = figures.residual_over_time(at[inside], residuals, noise, "tracker (mm)", is_distance=True)
    return Picture(svg, "How far the tracker is from where each stage expects it, same stretch.")


def before_and_after(verdict: Verdict, evidence: Evidence) -> list[Picture]:
    """Return a picture for each cause.

    A joint's cause shows the profile that it flattens most, the whole arm's the lag by channel.
    """
    if not verdict.causes:
        return []
    before, after = evidence.diagnostics, diagnostics_after(evidence)
    worst = worst_joint(verdict, evidence)
    pictures: list[Picture] = []
    for cause in verdict.causes:
        shared = [name for name in before.lag if name in after.lag]
        if cause.where in evidence.joints or not shared:
            at = evidence.joints.index(cause.where) if cause.where in evidence.joints else worst
            pictures.append(_profile(evidence, before, after, at))
            continue
        svg = figures.before_and_after(
            shared,
            np.array([1e3 * before.lag[name] for name in shared]),
            np.array([1e3 * after.lag[name] for name in shared]),
            "measured motion behind predicted (ms)",
        )
        pictures.append(Picture(svg, "How late each channel is, before and after."))
    return pictures


def _profile(evidence: Evidence, before: Diagnostics, after: Diagnostics, joint: int) -> Picture:
    pick = clearest_profile(before, after, joint)
    one, other = before.profiles[pick], after.profiles[pick]
    lines = [
        Line(name, each.centres[joint], 1e3 * each.mean[joint],
             1e3 * _spread(each.mean, each.rms)[joint])
        for name, each in (("before, base fit", one), ("after, extended", other))
    ]  # fmt: skip
    axis = AXES.get(one.over, one.over)
    svg = diagnostic.profile(
        lines, f"{axis} ({one.unit})", f"mean residual ({THOUSANDTHS[evidence.units[joint]]})",
        is_before_and_after=True,
    )  # fmt: skip
    words = (
        f"Mean residual of {evidence.joints[joint]} over the {axis}; a flat line at 0 is "
        "explained. Shaded: one standard deviation."
    )
    return Picture(svg, words)


def candidates(verdict: Verdict) -> Picture | None:
    """Return the best candidates with what they take off the held-out loss."""
    if not verdict.candidates:
        return None
    named = {(cause.effect, cause.where) for cause in verdict.causes}
    tied = {(cause.effect, cause.where) for tie in verdict.ties for cause in tie.causes}
    rows = [
        Row(
            effect=each.effect,
            where=each.where,
            screen=each.screen,
            gain=each.gain,
            low=None if each.gain_interval is None else each.gain_interval.low,
            high=None if each.gain_interval is None else each.gain_interval.high,
            is_named=(each.effect, each.where) in named,
            is_tied=(each.effect, each.where) in tied,
        )
        for each in _shown(verdict)
    ]
    words = "What each candidate takes off the held-out loss when the base is fitted with it."
    words += " Blue: named." if named else ""
    words += " Orange: one of a tie." if tied else ""
    return Picture(diagnostic.candidates(rows), words)


def _shown(verdict: Verdict) -> list[Scored]:
    """Return the candidates that were refitted, and the best few of the others."""
    refitted = [each for each in verdict.candidates if each.gain is not None]
    others = [each for each in verdict.candidates if each.gain is None]
    return [*refitted[:MOST_CANDIDATES], *others[:MOST_OTHERS]]


def unexplained(verdict: Verdict, evidence: Evidence) -> Picture:
    """Return the trajectories as lanes, with what was located marked."""
    named = {left.trajectory for left in verdict.unexplained}
    replays = [each for each in evidence.replays if each.name in named or each.split == "test"]
    replays = (replays or list(evidence.replays))[:MOST_LANES]
    names = [replay.name for replay in replays]
    lanes = [(replay.name, *lane(evidence, replay)) for replay in replays]
    spans = [
        (names.index(left.trajectory), left.begin, left.end, unexplained_mark(number))
        for number, left in enumerate(verdict.unexplained)
        if left.trajectory in names
    ]
    words = "What the best model leaves over, darker where more"
    words += "; letters are those of the table." if spans else "."
    return Picture(figures.timeline(lanes, spans, floor_name(verdict.held_out)), words)


def diagnostics(evidence: Evidence) -> list[Picture]:
    """Return how the residual of the base fit looks, for the joints that are furthest off."""
    found = evidence.diagnostics
    off = rms_by_joint(evidence.replays, "base_fit") / evidence.noise
    worst = [int(index) for index in np.argsort(-np.nan_to_num(off, posinf=1e9))[:MOST_JOINTS]]
    small = small_unit(evidence)
    pictures: list[Picture] = []
    for each in found.profiles:
        lines = [
            Line(evidence.joints[j], each.centres[j], 1e3 * each.mean[j],
                 1e3 * _spread(each.mean, each.rms)[j])
            for j in worst
            if np.isfinite(each.mean[j]).any()
        ]  # fmt: skip
        if lines:
            name = AXES.get(each.over, each.over)
            svg = diagnostic.profile(lines, f"{name} ({each.unit})", f"mean residual ({small})")
            pictures.append(Picture(svg, f"Against the {name}."))
    svg = diagnostic.directions(evidence.joints, 1e3 * found.forward, 1e3 * found.backward, small)
    pictures.append(Picture(svg, "By direction: a gap between the two is friction or play."))
    if found.lag:
        late = {name: 1e3 * seconds for name, seconds in found.lag.items()}
        words = "How late each channel is; a delay of the commands makes all late alike."
        pictures.append(Picture(diagnostic.lags(late), words))
    pictures.append(_spectrum(found, evidence, worst, small))
    return pictures


def base(verdict: Verdict) -> Picture | None:
    """Return the base parameters that moved most, as multiples of nominal; None without any.

    Where a centre of mass is has no such multiple: from 1 mm to 4 mm is not far.
    """
    rows = [
        row
        for row in verdict.base
        if row.nominal > 0 and min(row.base_fit, row.extended) > 0 and row.unit != "m"
    ]
    rows = sorted(rows, key=_moved, reverse=True)[:MOST_PARAMETERS]
    if not rows:
        return None

    def over(values: list[float]) -> Float64:
        nominal = np.array([row.nominal for row in rows])
        return np.maximum(np.array(values) / nominal, 1e-3)

    svg = diagnostic.base_ratios(
        [row.name for row in rows],
        over([row.base_fit for row in rows]),
        over([row.extended for row in rows]),
        over([row.interval.low for row in rows]),
        over([row.interval.high for row in rows]),
    )
    words = "Those that moved most, as multiples of nominal; the bar is the 95 % interval."
    return Picture(svg, words)


def _moved(row: BaseValue) -> float:
    return max(abs(np.log(row.base_fit / row.nominal)), abs(np.log(row.extended / row.nominal)))


def _spectrum(found: Diagnostics, evidence: Evidence, worst: list[int], small: str) -> Picture:
    lines = [Line(evidence.joints[j], found.frequency, 1e3 * found.spectrum[j]) for j in worst]
    words = "By frequency: a peak is a resonance, a steady fall is slow motion gone wrong."
    return Picture(diagnostic.spectrum(lines, f"residual in a band ({small})"), words)


def _spread(mean: Float64, rms: Float64) -> Float64:
    return np.sqrt(np.maximum(rms**2 - mean**2, 0.0))


def small_unit(evidence: Evidence) -> str:
    """Return what residuals of all joints are told in."""
    names = sorted({THOUSANDTHS[unit] for unit in evidence.units}, reverse=True)
    return ", ".join(names)
