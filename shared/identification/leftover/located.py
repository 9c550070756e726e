"""What stays unexplained: at which joint, when, in which phase, how much.

Joints and what is behind the encoders are looked at apart. Which joint an event is from is told by
torque, not by motion: a push at one joint moves them all, but only there a torque is missing.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.places import moving, place_of
from shared.identification.dataset.types import Float64
from shared.identification.fitting.problem import BLOCK, Problem, Variant
from shared.identification.leftover.happened import comes_back, is_aside
from shared.identification.leftover.phases import (
    AGAIN,
    AT_TIMES,
    FROM_THEN,
    ONCE,
    Look,
    Phase,
    phase_of,
    push_of,
)
from shared.identification.leftover.pushes import Push, is_one_way, pushes_of
from shared.identification.leftover.scan import Width, merged, scan, stretches, width_of
from shared.identification.leftover.tracks import Track, missing_of, tracks_of
from shared.identification.noise.floor import repeat_differences
from shared.identification.noise.quiet import OF_PAIR
from shared.identification.verdict import Unexplained
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.signals import pose_error

LEAST_SIZE = 1.3
"""Of what is listed, in noise floors."""
MOST = 12
"""Entries; the largest."""
MOST_PUSHES = 40
"""Of these, what came from outside is listed beside."""
_GAP = 10
"""Blocks between stretches that are one."""
_ALSO = 0.5
"""A joint is named too whose missing torque stands out so many times as much as the first's."""
_NEAR = 5
"""Blocks that a power is taken over."""
_AFTER = 50
"""Blocks after a push in which what is off is put down to it."""
_TURN = 1e-4
"""Of a difference quotient (rad, m)."""
_BY_JOINT = 0.8
"""Share of what is behind the encoders from which it is put down to a joint."""


@dataclass(frozen=True)
class _Group:
    """Stretches with one place."""

    where: str
    joint: int | None
    pieces: dict[int, list[slice]]
    """By track."""


def leftovers(
    problem: Problem, variant: Variant, segments: Sequence[int], known: Sequence[Unexplained] = ()
) -> tuple[Unexplained, ...]:
    """Return what a model does not explain, largest first.

    Args:
        problem: data set, arm and noise floor.
        variant: the model with everything that was named.
        segments: what to look at, as a rule all of the problem's.
        known: what is known to have come from outside. It is told again as it was where it does
            not show anew: of an arm that nothing holds, what is simulated goes astray with the
            first push, and torques are then missing all the time.
    """
    joints, trackers = tracks_of(problem, variant, segments)
    of_joints, of_trackers = _widths(problem)
    missing = _Missing(problem, variant)
    found: list[tuple[float, Unexplained]] = []
    pushed: list[tuple[float, Unexplained]] = []
    if joints:
        happened = [is_aside(problem, track) for track in joints]
        pushes = pushes_of(joints, [missing.of(track) for track in joints], happened)
        pushes = tuple(
            one
            for one in pushes
            if not comes_back(problem, joints[one.track], one.joint, one.piece)
        )
        pushed = _pushed(problem, joints, pushes, missing)
        kept = [each for each in known if not any(_is_same(each, one) for _, one in pushed)]
        pushed += [(_blocks(each) * each.times_noise**2, each) for each in kept]
        spans = [(each.track, each.piece) for each in pushes]
        spans += [_span(problem, joints, each) for each in kept]
        pieces = _beside(_pieces(joints, of_joints), spans)
        for group in _by_joint(problem, joints, pieces, missing):
            found += _told(problem, joints, group, missing)
    if trackers and of_trackers is not None:
        pieces = _pieces(trackers, of_trackers)
        for group in _behind(problem, trackers, pieces):
            found += _told(problem, trackers, group, None)
    found.sort(key=lambda each: -each[0])
    pushed.sort(key=lambda each: -each[0])
    listed = [*found[:MOST], *pushed[:MOST_PUSHES]]
    return tuple(each for _, each in sorted(listed, key=lambda each: -each[0]))


class _Missing:
    """Missing torques of tracks, each computed once and when it is wanted."""

    def __init__(self, problem: Problem, variant: Variant) -> None:
        self._problem, self._variant = problem, variant
        self._known: dict[int, Float64] = {}

    def of(self, track: Track) -> Float64:
        if track.trajectory not in self._known:
            self._known[track.trajectory] = missing_of(self._problem, self._variant, track)
        return self._known[track.trajectory]


def _widths(problem: Problem) -> tuple[Width, Width | None]:
    """Return how wide the noise of joints and tracker is, by what repeats differ."""
    noise, count = problem.noise, len(problem.noise.joints)
    subject = problem.subject
    pairs = (
        [] if noise.has_free_starts else repeat_differences(problem.dataset, BLOCK, subject.starts)
    )
    of_joints = width_of(
        [
            noise.floors(each.joints * OF_PAIR, noise.whitening(subject.nominal, each.q))
            for each in pairs
        ],
        noise.correlation[:count],
        noise.is_measured,
    )
    if noise.tracker is None:
        return of_joints, None
    floor = noise.tracker
    return of_joints, width_of(
        [each.tracker * OF_PAIR / floor for each in pairs if each.tracker is not None],
        noise.correlation[count : count + 6],
        noise.is_measured,
    )


def _pieces(tracks: Sequence[Track], width: Width) -> list[list[list[slice]]]:
    """Return stretches far over the noise by track and channel."""
    hot = scan([each.x for each in tracks], width)
    spread = np.sqrt(width.power[0])
    return [
        [
            merged(
                stretches(
                    track.x[:, channel], marks[:, channel], float(spread[channel]),
                    float(width.correlation[channel]),
                ),
                _GAP,
            )
            for channel in range(track.x.shape[1])
        ]
        for track, marks in zip(tracks, hot, strict=True)
    ]  # fmt: skip


def _pushed(
    problem: Problem, tracks: Sequence[Track], pushes: Sequence[Push], missing: _Missing
) -> list[tuple[float, Unexplained]]:
    """Return what came from outside or looks like it, each entry with its energy."""
    found: list[tuple[float, Unexplained]] = []
    for push in pushes:
        group = _Group(problem.subject.joints[push.joint], push.joint, {})
        is_once = sum(each.joint == push.joint for each in pushes) == 1
        words = AGAIN if push.is_again else ONCE if is_once else AT_TIMES
        track, is_external = tracks[push.track], not push.is_again
        entry = _entry(problem, track, group, [push.piece], words, missing, is_external)
        blocks = push.piece.stop - push.piece.start
        found.append((blocks * entry.times_noise**2, entry))
    return found


def _is_same(one: Unexplained, other: Unexplained) -> bool:
    """Return whether two pushes of one joint overlap."""
    is_there = (one.where, one.trajectory) == (other.where, other.trajectory)
    return is_there and one.begin < other.end and other.begin < one.end


def _blocks(push: Unexplained) -> int:
    return round((push.end - push.begin) / BLOCK)


def _span(problem: Problem, tracks: Sequence[Track], push: Unexplained) -> tuple[int, slice]:
    """Return the number of a push's track, and its blocks there."""
    names = [problem.dataset.trajectories[each.trajectory].name for each in tracks]
    number = names.index(push.trajectory)
    begin, end = np.searchsorted(tracks[number].at, (push.begin, push.end))
    return number, slice(int(begin), int(end))


def _beside(
    pieces: list[list[list[slice]]], pushes: Sequence[tuple[int, slice]]
) -> list[list[list[slice]]]:
    """Return stretches without what pushes, by track, and what they left for a while explain."""
    out: list[list[list[slice]]] = []
    for number, channels in enumerate(pieces):
        pushed = [piece for track, piece in pushes if track == number]
        if not pushed:
            out.append(channels)
            continue
        out.append([[left for piece in channel for left in _left(piece, pushed)]
                    for channel in channels])  # fmt: skip
    return out


def _left(piece: slice, pushed: Sequence[slice]) -> list[slice]:
    """Return what of a stretch is in no push nor soon after one."""
    hot = np.ones(piece.stop - piece.start, np.bool_)
    for each in pushed:
        begin, end = each.start - _NEAR - piece.start, each.stop + _AFTER - piece.start
        hot[max(begin, 0) : max(end, 0)] = False
    edges = np.flatnonzero(np.diff(np.r_[False, hot, False].astype(np.int8))).reshape(-1, 2)
    return [slice(piece.start + int(a), piece.start + int(b)) for a, b in edges if b - a >= _NEAR]


def _by_joint(
    problem: Problem, tracks: Sequence[Track], pieces: list[list[list[slice]]], missing: _Missing
) -> list[_Group]:
    """Return stretches by the joint at which a torque is missing."""
    found: dict[int, _Group] = {}
    for index, (track, channels) in enumerate(zip(tracks, pieces, strict=True)):
        for event in merged([piece for channel in channels for piece in channel], 0):
            for joint in _joints_of(missing.of(track), track, event):
                group = found.setdefault(joint, _Group(problem.subject.joints[joint], joint, {}))
                own = [each for each in channels[joint] if _overlap(each, event)]
                group.pieces.setdefault(index, []).extend(own or [event])
    return list(found.values())


def _joints_of(torque: Float64, track: Track, event: slice) -> list[int]:
    """Return at which joints a torque is missing in an event; else the one furthest off."""
    late = torque[_NEAR:] - torque[:-_NEAR]
    noise = 1.48 * np.median(np.abs(late), axis=0) / np.sqrt(2.0)
    score = np.sqrt(np.mean(torque[event] ** 2, axis=0)) / np.maximum(noise, 1e-9)
    off = np.sqrt(np.mean(track.x[event] ** 2, axis=0))
    score = np.where(off > LEAST_SIZE, score, 0.0)
    if score.max() < 2.0:
        return [int(np.argmax(off))]
    return [int(each) for each in np.flatnonzero(score >= _ALSO * score.max())]


def _behind(
    problem: Problem, tracks: Sequence[Track], pieces: list[list[list[slice]]]
) -> list[_Group]:
    """Return stretches behind the encoders, by the joint that would look like them, if one does."""
    found: dict[int | None, _Group] = {}
    for index, (track, channels) in enumerate(zip(tracks, pieces, strict=True)):
        events = merged([piece for channel in channels for piece in channel], 0)
        joint = _looks_like(problem, track, events) if events else None
        where = "tracker" if joint is None else f"{problem.subject.joints[joint]}, tracker"
        if events:
            found.setdefault(joint, _Group(where, joint, {})).pieces[index] = events
    return list(found.values())


def _looks_like(problem: Problem, track: Track, events: Sequence[slice]) -> int | None:
    """Return the joint whose turn behind its encoder would move the tool so; None if none."""
    assert problem.noise.tracker is not None
    rows = _rows(events)
    plant, model, q = problem.subject.plant, problem.subject.nominal.model, track.q[rows]
    here, x = tool_poses(plant, model, q), track.x[rows]
    shares: list[float] = []
    for joint in range(q.shape[1]):
        turned = q.copy()
        turned[:, joint] += _TURN
        column = pose_error(tool_poses(plant, model, turned), here) / problem.noise.tracker
        along = np.sum(column * x, axis=1) ** 2 / np.maximum(np.sum(column**2, axis=1), 1e-12)
        shares.append(float(along.sum() / np.sum(x**2)))
    best = int(np.argmax(shares))
    return best if shares[best] >= _BY_JOINT else None


def _told(
    problem: Problem, tracks: Sequence[Track], group: _Group, missing: _Missing | None
) -> list[tuple[float, Unexplained]]:
    """Return a group in words, each entry with its energy."""
    channels = _channels(tracks, group) if missing is None else np.array([group.joint])
    looks = [
        _look(problem, track, group.pieces.get(index, []), channels)
        for index, track in enumerate(tracks)
    ]
    moves = [problem.subject.joints.index(each.label) for each in moving(problem.subject)]
    phase = phase_of(looks, [group.joint] if group.joint is not None else moves)
    torques = _torques(tracks, group, missing)
    pushes = [
        push_of(torques[index], piece)
        for index, pieces in group.pieces.items()
        if index in torques
        for piece in merged(pieces, _GAP)
    ]
    is_external = False
    if len(pushes) == 1 and (push := pushes[0]) is not None and group.joint is not None:
        is_external = any(
            is_one_way(each[push]) and not comes_back(problem, tracks[index], group.joint, push)
            for index, each in torques.items()
        )
        phase = Phase(ONCE)  # where friction holds, the arm stays off when the push is over
    words = _words(problem, phase, group)
    found: list[tuple[float, Unexplained]] = []
    for index, (track, look) in enumerate(zip(tracks, looks, strict=True)):
        if not look.pieces:
            continue
        alone = phase.words in (ONCE, AT_TIMES)
        for pieces in ([piece] for piece in look.pieces) if alone else [list(look.pieces)]:
            there = pieces
            if phase.words == ONCE and index in torques:
                there = [push_of(torques[index], piece) or piece for piece in pieces]
            entry = _entry(problem, track, group, there, words, missing, is_external)
            if entry.times_noise >= LEAST_SIZE:
                blocks = sum(piece.stop - piece.start for piece in pieces)
                found.append((blocks * entry.times_noise**2, entry))
    return found


def _torques(
    tracks: Sequence[Track], group: _Group, missing: _Missing | None
) -> dict[int, Float64]:
    """Return float64[B], the torque that is missing at a group's joint, by track."""
    if missing is None or group.joint is None:
        return {}
    return {index: missing.of(tracks[index])[:, group.joint] for index in group.pieces}


def _channels(tracks: Sequence[Track], group: _Group) -> NDArray[np.int64]:
    """Return the channels behind the encoders in which most of a group is."""
    rows = [tracks[index].x[_rows(pieces)] for index, pieces in group.pieces.items() if pieces]
    excess: Float64 = np.mean(np.concatenate(rows) ** 2, axis=0) - 1.0
    return np.flatnonzero(excess >= 0.25 * excess.max())


def _look(problem: Problem, track: Track, pieces: list[slice], channels: NDArray[np.int64]) -> Look:
    power: Float64 = np.mean(track.x[:, channels] ** 2, axis=1)
    near = np.convolve(power, np.ones(_NEAR) / _NEAR, "same")
    before = problem.dataset.trajectories[: track.trajectory]
    begins = sum(each.duration for each in before)
    found = tuple(merged(pieces, _GAP))
    return Look(track.at, begins, near, found, track.q, track.qd, track.effort, track.load)


def _entry(
    problem: Problem, track: Track, group: _Group, pieces: list[slice], words: str,
    missing: _Missing | None, is_external: bool,
) -> Unexplained:  # fmt: skip
    rows = _rows(pieces)
    torque = None
    if missing is not None and group.joint is not None:
        of_joint = place_of(problem.subject, group.where)
        own: Float64 = track.x[rows, group.joint]
        lacks: Float64 = missing.of(track)[rows, group.joint]
        times, torque = float(np.sqrt(np.mean(own**2))), float(np.sqrt(np.mean(lacks**2)))
        size, unit = times * float(problem.noise.joints[group.joint]), of_joint.angle
        torque_unit = of_joint.torque
    else:
        assert problem.noise.tracker is not None
        off: Float64 = np.mean(track.x[rows] ** 2, axis=0)
        is_way = np.mean(off[:3]) >= np.mean(off[3:])
        part = np.arange(3) if is_way else np.arange(3, 6)
        times = float(np.sqrt(np.mean(off[part])))
        size = float(np.sqrt(np.sum(off[part] * problem.noise.tracker[part] ** 2)))
        unit, torque_unit = ("m" if is_way else "rad"), ""
    return Unexplained(
        where=group.where,
        trajectory=problem.dataset.trajectories[track.trajectory].name,
        begin=max(float(track.at[rows[0]]) - 0.5 * BLOCK, 0.0),
        end=float(track.at[rows[-1]]) + 0.5 * BLOCK,
        phase=words,
        size=size,
        unit=unit,
        times_noise=times,
        torque=torque,
        torque_unit=torque_unit,
        is_external=is_external,
    )


def _words(problem: Problem, phase: Phase, group: _Group) -> str:
    if phase.joint is None or group.joint is not None or phase.words in (ONCE, FROM_THEN):
        return phase.words
    return f"{phase.words} ({problem.subject.joints[phase.joint]})"


def _overlap(one: slice, other: slice) -> bool:
    return bool(one.start < other.stop and other.start < one.stop)


def _rows(pieces: Sequence[slice]) -> NDArray[np.int64]:
    """Return the numbers of the blocks in slices."""
    numbers = [np.arange(each.start, each.stop, dtype=np.int64) for each in pieces]
    return np.concatenate(numbers)
