"""Verdicts and evidence made by hand, one for each word: what a page must be able to show."""

from collections.abc import Sequence
from dataclasses import dataclass

import msgspec
import numpy as np

from shared.identification.conclusion.diagnose import diagnose
from shared.identification.conclusion.evidence import Evidence, Replay
from shared.identification.conclusion.model_file import Carried
from shared.identification.dataset.types import Float64
from shared.identification.verdict import (
    BaseValue,
    Cause,
    HeldOut,
    Interval,
    Limit,
    Scored,
    Tie,
    Unexplained,
    Verdict,
    Word,
)

JOINTS = (
    "shoulder_pan", "shoulder_lift", "upper_arm_roll", "elbow_flex", "forearm_roll", "wrist_flex",
    "wrist_roll",
)  # fmt: skip
WORDS: tuple[Word, ...] = ("named", "none", "tie", "base_too_coarse", "unexplained")
NOISE = np.array([3.0, 3.0, 3.0, 3.0, 4.0, 4.0, 5.0]) * 1e-4
RATE = 100.0


@dataclass(frozen=True)
class Example:
    """What a finder returns, and what the files say of it."""

    verdict: Verdict
    evidence: Evidence
    carried: tuple[Carried, ...] = ()


def example(word: Word, joints: Sequence[str] = JOINTS, *, has_tracker: bool = True) -> Example:
    """Return an example of a verdict."""
    return _MAKERS[word](joints, has_tracker)


FRICTION = Cause(
    effect="coulomb_friction", where="elbow_flex", quantity="level", value=0.612, unit="N m",
    interval=Interval(low=0.588, high=0.636), title="the joint has dry friction",
    signature="A step in the residual at each reversal, the same at every speed.",
    share=0.71, share_interval=Interval(low=0.66, high=0.75),
)  # fmt: skip
LATENCY = Cause(
    effect="command_latency", where="", quantity="delay", value=0.0304, unit="s",
    interval=Interval(low=0.0298, high=0.031), title="commands reach the controller late",
    signature="Every channel lags by the same time, so the residual grows with speed.",
    share=0.27, share_interval=Interval(low=0.22, high=0.31),
)  # fmt: skip
OFFSET = msgspec.structs.replace(
    LATENCY, effect="tracker_latency", title="the tracker reports late", value=0.021,
    signature="Only the tracker lags.", share=0.4,
)  # fmt: skip


def replays(
    joints: Sequence[str],
    rng: np.random.Generator,
    lag: tuple[float, float, float],
    step: tuple[float, float, float],
    *,
    has_tracker: bool,
    push: bool = False,
) -> tuple[Replay, ...]:
    """Return five recordings; lag (s) and a step with the direction (rad) by stage."""
    return tuple(
        _replay(name, split, joints, rng, lag, step, has_tracker, push and name == "swings test")
        for name, split in (
            ("sines 1", "train"), ("crawl", "train"), ("swings", "train"), ("sines test", "test"),
            ("swings test", "test"),
        )
    )  # fmt: skip


def _replay(
    name: str, split: str, joints: Sequence[str], rng: np.random.Generator,
    lag: tuple[float, float, float], step: tuple[float, float, float], has_tracker: bool,
    is_pushed: bool,
) -> Replay:  # fmt: skip
    at: Float64 = np.arange(0.0, 14.0, 1.0 / RATE)
    count = len(joints)
    speed = 0.25 if name == "crawl" else 1.6 if "swings" in name else 1.0
    hertz = rng.uniform(0.15, 0.6, (3, count)) * speed
    phase = rng.uniform(0.0, 2 * np.pi, (3, count))
    size = rng.uniform(0.08, 0.3, (3, count))
    angle = 2 * np.pi * hertz * at[:, None, None] + phase
    q: Float64 = (size * np.sin(angle)).sum(axis=1)
    qd: Float64 = (size * 2 * np.pi * hertz * np.cos(angle)).sum(axis=1)
    at_joint = np.zeros(count)
    at_joint[min(3, count - 1)] = 1.0
    noise = NOISE[:count] * rng.standard_normal((len(at), count))
    noise = np.apply_along_axis(lambda column: np.convolve(column, [0.5, 0.5], "same"), 0, noise)
    predicted = {
        stage: q + lag[k] * qd + step[k] * np.tanh(qd / 0.05) * at_joint
        for k, stage in enumerate(("nominal", "base_fit", "extended"))
    }
    measured = q + noise
    if is_pushed:
        measured += 0.012 * np.exp(-(((at - 8.2) / 0.25) ** 2))[:, None] * at_joint
    loss = {
        stage: float(np.sqrt(np.mean(((measured - each) / NOISE[:count]) ** 2)))
        for stage, each in predicted.items()
    }
    tracker_at = np.arange(0.0, 14.0, 1.0 / 60.0)
    lever = np.linspace(0.9, 0.1, count)

    def tool(motion: Float64, spread: float) -> Float64:
        angle = np.stack([np.interp(tracker_at, at, column) for column in motion.T], axis=1)
        x = 0.6 + 0.3 * np.sin(angle @ lever)
        out = np.stack([x, angle @ lever * 0.4, 0.3 * np.cos(angle @ lever[::-1])], axis=1)
        out += spread * rng.standard_normal(out.shape)
        return np.concatenate([out, np.tile([1.0, 0.0, 0.0, 0.0], (len(out), 1))], axis=1)

    return Replay(
        name=name, split="train" if split == "train" else "test", at=at, q=measured,
        predicted=predicted, loss=loss, effort=3.0 * qd + 2.0 * np.sign(qd) * at_joint,
        tracker_at=tracker_at if has_tracker else None,
        tracker=tool(q, 5e-4) if has_tracker else None,
        tracked={k: tool(v, 0.0) for k, v in predicted.items()} if has_tracker else {},
    )  # fmt: skip


def _evidence(
    joints: Sequence[str], found: tuple[Replay, ...], *, repeats: bool = True
) -> Evidence:
    units = ("rad",) * len(joints)
    return Evidence(
        joints=tuple(joints), units=units, noise=NOISE[: len(joints)],
        tracker_noise=(5e-4, 1e-3), noise_from_repeats=repeats, replays=found,
        diagnostics=diagnose(found, joints, units),
    )  # fmt: skip


def _held_out(found: Sequence[Replay], share: float, *, has_tracker: bool) -> HeldOut:
    losses = {
        stage: float(np.sqrt(np.mean([r.loss[stage] ** 2 for r in found if r.split == "test"])))
        for stage in ("nominal", "base_fit", "extended")
    }
    plain = {stage: 0.33 * loss for stage, loss in losses.items()} | {"noise_floor": 0.33}
    return HeldOut(
        nominal=losses["nominal"], base_fit=losses["base_fit"], extended=losses["extended"],
        noise_floor=1.0, share_removed=share,
        share_interval=Interval(low=share - 0.03, high=min(1.0, share + 0.02)), joints_mrad=plain,
        tracker_mm={stage: 1.6 * loss for stage, loss in plain.items()} if has_tracker else {},
    )  # fmt: skip


def _scored(effect: str, where: str, screen: float, gain: float | None, why: str = "") -> Scored:
    interval = None if gain is None else Interval(low=gain - 0.3, high=gain + 0.35)
    return Scored(
        effect=effect, where=where, screen=screen, gain=gain, gain_interval=interval,
        value=None if gain is None else 0.1 * abs(gain), unit="N m", why_not=why,
    )  # fmt: skip


CANDIDATES = (
    _scored("coulomb_friction", "elbow_flex", 0.62, 5.1),
    _scored("command_latency", "", 0.41, 2.2),
    _scored("stribeck_friction", "elbow_flex", 0.58, 4.6, "loses to coulomb_friction elbow_flex"),
    _scored("asymmetric_friction", "elbow_flex", 0.35, 0.9, "adds nothing beside what was named"),
    _scored("load_friction", "elbow_flex", 0.33, 0.4, "its interval reaches 0"),
    _scored("joint_elasticity", "elbow_flex", 0.2, -0.1, "makes held-out motion worse"),
    _scored("payload", "", 0.08, None, "too little in the screen"),
    _scored("cogging", "wrist_roll", 0.03, None, "too little in the screen"),
    _scored("torque_bias", "shoulder_lift", 0.02, None, "too little in the screen"),
)


LIMITS = (
    Limit(effect="payload", title="the tool is heavier than the model says", where="",
          quantity="mass", size=0.034, unit="kg"),
    Limit(effect="torque_gain", title="the drive gives another torque", where="wrist_roll",
          quantity="share", size=None, unit="1"),
    Limit(effect="torque_gain", title="the drive gives another torque", where="elbow_flex",
          quantity="share", size=0.21, unit="1"),
)  # fmt: skip


def _base(*, is_bent: bool) -> tuple[BaseValue, ...]:
    rng = np.random.default_rng(4)
    rows: list[BaseValue] = []
    for word, unit, nominal in (("damping", "N m s/rad", 1.0), ("armature", "kg m^2", 0.02)):
        for joint in JOINTS:
            truth = nominal * float(np.exp(rng.normal(0.0, 0.12)))
            bent = truth * float(np.exp(rng.normal(0.35, 0.3))) if is_bent else truth
            ends = Interval(low=0.95 * truth, high=1.05 * truth)
            rows.append(
                BaseValue(name=f"{word} {joint}", unit=unit, nominal=nominal, base_fit=bent,
                          extended=truth, interval=ends)
            )  # fmt: skip
    return tuple(rows)


def _verdict(
    word: Word, sentence: str, held_out: HeldOut, *, causes: tuple[Cause, ...] = (),
    ties: tuple[Tie, ...] = (), unexplained: tuple[Unexplained, ...] = (),
    candidates: tuple[Scored, ...] = CANDIDATES, record_next: tuple[str, ...] = (),
    starts_agree: bool = True,
) -> Verdict:  # fmt: skip
    return Verdict(
        verdict=word, sentence=sentence, causes=causes, ties=ties, unexplained=unexplained,
        held_out=held_out, candidates=candidates,
        ruled_out={"gravity_tilt": "the model has no gravity", "clock_skew": "under 60 s long"},
        limits=() if word in ("unexplained", "base_too_coarse") else LIMITS,
        base=_base(is_bent=bool(causes)),
        caveats=("joints are logged 100 times a second; fast effects need more",
                 "no recording is with other gains or another load"),
        record_next=record_next, starts_agree=starts_agree, dataset="5e" * 32,
        model="pr2 right, nominal", seed=7, version="0.5.0", commit="0123456789ab", cpu_s=41.3,
        seconds={"noise floor": 0.2, "base fit": 18.4, "diagnostics": 0.3, "screen": 9.1,
                 "refit": 10.9, "decide": 1.9, "unexplained": 0.5},
    )  # fmt: skip


def _named(joints: Sequence[str], has_tracker: bool) -> Example:
    rng = np.random.default_rng(1)
    found = replays(joints, rng, (0.045, 0.008, 0.0), (0.02, 0.009, 0.0002),
                    has_tracker=has_tracker)  # fmt: skip
    where = joints[min(3, len(joints) - 1)]
    friction = msgspec.structs.replace(FRICTION, where=where)
    verdict = _verdict(
        "named",
        f"The elbow rubs: dry friction of 0.61 N m at {where}, and commands arrive 30 ms late. "
        "Together they remove 98 % of what the base fit leaves unexplained.",
        _held_out(found, 0.98, has_tracker=has_tracker),
        causes=(friction, LATENCY),
        candidates=tuple(
            msgspec.structs.replace(each, where=where if each.where == "elbow_flex" else each.where)
            for each in CANDIDATES
        ),
        record_next=("A run with 0.5 kg more in the hand: payload and armature part there.",),
    )
    carried = (
        Carried("coulomb_friction", where, True, "as friction loss of the arm"),
        Carried("command_latency", "", True, "as command.delay"),
    )
    return Example(verdict, _evidence(joints, found), carried)


def _none(joints: Sequence[str], has_tracker: bool) -> Example:
    rng = np.random.default_rng(2)
    found = replays(joints, rng, (0.02, 0.0, 0.0), (0.004, 0.0, 0.0), has_tracker=has_tracker)
    weak = tuple(
        msgspec.structs.replace(
            each, gain=None if each.gain is None else 0.01 * each.gain, why_not="not above chance",
            gain_interval=Interval(low=-0.05, high=0.08) if each.gain is not None else None,
        )
        for each in CANDIDATES
    )  # fmt: skip
    verdict = _verdict(
        "none", "With its base fitted the simulation is as good as the recordings repeat.",
        _held_out(found, 0.0, has_tracker=has_tracker), candidates=weak,
    )  # fmt: skip
    return Example(verdict, _evidence(joints, found))


def _tie(joints: Sequence[str], has_tracker: bool) -> Example:
    rng = np.random.default_rng(3)
    found = replays(joints, rng, (0.06, 0.02, 0.0), (0.0, 0.0, 0.0), has_tracker=has_tracker)
    tie = Tie(
        causes=(LATENCY, OFFSET), alike=0.998,
        record="Log the joints as well: a late tracker leaves them as they are.",
    )  # fmt: skip
    verdict = _verdict(
        "tie", "Either commands arrive 30 ms late, or the tracker reports 21 ms late.",
        _held_out(found, 0.0, has_tracker=has_tracker), ties=(tie,), record_next=(tie.record,),
    )  # fmt: skip
    return Example(verdict, _evidence(joints, found, repeats=False))


def _coarse(joints: Sequence[str], has_tracker: bool) -> Example:
    rng = np.random.default_rng(5)
    found = replays(joints, rng, (0.06, 0.03, 0.03), (0.02, 0.012, 0.012), has_tracker=has_tracker)
    verdict = _verdict(
        "base_too_coarse",
        "No single cause explains it: the base model itself does not fit this arm.",
        _held_out(found, 0.0, has_tracker=has_tracker), starts_agree=False,
        record_next=("A chirp of the wrist up to 8 Hz.", "The crawl again, with the arm unloaded."),
    )  # fmt: skip
    return Example(verdict, _evidence(joints, found))


def _unexplained(joints: Sequence[str], has_tracker: bool) -> Example:
    rng = np.random.default_rng(6)
    found = replays(joints, rng, (0.03, 0.0, 0.0), (0.01, 0.0, 0.0), has_tracker=has_tracker,
                    push=True)  # fmt: skip
    where = joints[min(3, len(joints) - 1)]
    left = (
        Unexplained(where=where, trajectory="swings test", begin=7.7, end=8.7, phase="once",
                    size=0.0082, unit="rad", times_noise=27.3),
        Unexplained(where="tracker", trajectory="sines test", begin=2.0, end=2.5,
                    phase="after reversals", size=0.0021, unit="m", times_noise=4.1),
    )  # fmt: skip
    verdict = _verdict(
        "unexplained",
        f"Something moved {where} by 8 mrad once, from 7.7 to 8.7 s of swings test; no known "
        "cause does that.",
        _held_out(found, 0.0, has_tracker=has_tracker), unexplained=left,
        record_next=("The same motion again: what happens once is not the model's.",),
    )  # fmt: skip
    return Example(verdict, _evidence(joints, found))


_MAKERS = {
    "named": _named, "none": _none, "tie": _tie, "base_too_coarse": _coarse,
    "unexplained": _unexplained,
}  # fmt: skip
