"""Finds what came from outside: torques that were missing for a moment, whatever the arm did.

A push is told from a law that the model lacks by three things. Its torque is of one sign and begins
and ends at once, it is far over what is missing otherwise, and where the same joint was at the same
place as fast and as loaded at other times, that torque was not missing. What comes again and again
at one joint alone, in most recordings, is a law, too: one that goes by something else than those.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shared.identification.dataset.types import Float64
from shared.identification.fitting.problem import BLOCK, Problem
from shared.identification.leftover.phases import since_reversal
from shared.identification.leftover.scan import merged
from shared.identification.leftover.tracks import Track

_FAR = 6.0
"""Missing torque of a push, in standard deviations of what is missing otherwise."""
_SHORTEST, _LONGEST = 0.06, 2.0
"""Of a push (s)."""
_SMEARED = 5
"""Blocks that a torque is smeared over: it is taken from a motion smoothed that much."""
_QUIET = 0.5
"""Share of a push's torque that may be missing just before and after it."""
_ONE_WAY = 0.9
"""Share of the missing torque that has to be of one sign."""
_SEEN = 2.0
"""Root mean square of the joint's residual while it is pushed, in noise floors, at least."""
_ALIKE = 20
"""Other instants that an instant of a push is compared with."""
_ELSEWHERE = 0.5
"""Share of these at which the torque may be missing too."""
_AFTER = 0.3
"""Time after a reversal in which a gear with play lets go (s)."""
_RECUR = 5
"""Pushes of one joint alone, in three recordings and most of them, that nobody makes by chance."""
_LATER = 0.3
"""What is not counted after a push, while the arm swings back (s)."""


@dataclass(frozen=True)
class Push:
    """Something outside pushed a joint."""

    track: int
    """Number of the track."""
    joint: int
    piece: slice
    """Blocks of the track."""
    begin: float
    """(s)."""
    end: float
    """(s)."""
    is_again: bool = False
    """Whether it is one of so many at its joint that they are a law rather than pushes."""


def pushes_of(
    tracks: Sequence[Track],
    missing: Sequence[Float64],
    happened: Sequence[NDArray[np.bool_]] | None = None,
) -> tuple[Push, ...]:
    """Return the pushes in recordings.

    Args:
        tracks: of the joints.
        missing: float64[B, J], the torque that is missing in each (N m, N).
        happened: bool[B] of each, where it is known that something happened: there a torque need
            only be plain to be a push.
    """
    if happened is None:
        happened = [np.zeros(len(each), np.bool_) for each in missing]
    found: list[Push] = []
    for joint in range(missing[0].shape[1] if missing else 0):
        every = np.concatenate([each[:, joint] for each in missing])
        centre = float(np.median(every))
        usual = 1.48 * float(np.median(np.abs(every - centre)))
        torques = [each[:, joint] - centre for each in missing]
        states = _states(tracks, joint)
        own: list[Push] = []
        for number, (track, torque) in enumerate(zip(tracks, torques, strict=True)):
            for piece in _pieces(torque, _FAR * usual):
                if not _is_seen(track.x[:, joint], piece):
                    continue
                begin = max(float(track.at[piece.start]) - 0.5 * BLOCK, 0.0)
                end = float(track.at[piece.stop - 1]) + 0.5 * BLOCK
                push = Push(number, joint, piece, begin, end)
                if happened[number][piece].any():
                    found.append(push)
                    continue
                size = float(np.median(np.abs(torque[piece])))
                is_sudden = _is_sudden(torque, piece, size)
                if is_sudden and not _goes_with_state(states, torques, number, piece, size):
                    own.append(push)
        found += [] if _follow_reversals(tracks, own, joint) else own
    pushed = {each.joint for each in found}
    again = {joint for joint in pushed if _recur(found, joint, len(tracks))}
    return tuple(replace(each, is_again=each.joint in again) for each in found)


def not_counted(problem: Problem, segment: int, spans: Sequence[tuple[float, float]]) -> np.ndarray:
    """Return bool[B]: blocks of a segment in which pushes show.

    Args:
        problem: has the segment.
        segment: its number.
        spans: begin and end of each push in the segment's recording (s).
    """
    begin = problem.segments[segment].recorded.begin
    at = begin + BLOCK * (np.arange(problem.shape_of(segment)[0]) + 0.5)
    out = np.zeros(len(at), np.bool_)
    for first, last in spans:
        if last + _SMEARED * BLOCK > begin:  # else the part starts from a state after it
            out |= (at > first - _SMEARED * BLOCK) & (at < last + _LATER)
    return out


def _pieces(torque: Float64, limit: float) -> list[slice]:
    """Return stretches of so much torque, out to where half of it is left."""
    hot = np.abs(torque) > max(limit, 1e-9)
    edges = np.flatnonzero(np.diff(np.r_[False, hot, False].astype(np.int8))).reshape(-1, 2)
    found: list[slice] = []
    for piece in merged([slice(int(a), int(b)) for a, b in edges], _SMEARED):
        half = 0.5 * float(np.median(np.abs(torque[piece])))
        begin, end = int(piece.start), int(piece.stop)
        while begin > 0 and abs(torque[begin - 1]) > half:
            begin -= 1
        while end < len(torque) and abs(torque[end]) > half:
            end += 1
        if _SHORTEST <= BLOCK * (end - begin) <= _LONGEST:
            found.append(slice(begin, end))
    return found


def is_one_way(torque: Float64) -> bool:
    """Return whether a torque is of one sign nearly throughout."""
    return abs(float(torque.sum())) >= _ONE_WAY * float(np.abs(torque).sum())


def _is_sudden(torque: Float64, piece: slice, size: float) -> bool:
    """Return whether a torque is of one sign, and little is missing just before and after.

    Of one that is there from the begin nothing says that it began.
    """
    before = np.abs(torque[max(piece.start - 2 * _SMEARED, 0) : max(piece.start - _SMEARED, 0)])
    after = np.abs(torque[piece.stop + _SMEARED : piece.stop + 2 * _SMEARED])
    if not len(before):
        return False
    around = [float(np.median(each)) for each in (before, after) if len(each)]
    return is_one_way(torque[piece]) and all(each < _QUIET * size for each in around)


def _is_seen(x: Float64, piece: slice) -> bool:
    """Return whether the joint's position shows it, not a derivative of noise alone."""
    shown = x[piece.start : piece.stop + _SMEARED]
    return float(np.sqrt(np.mean(shown**2))) > _SEEN


def _states(tracks: Sequence[Track], joint: int) -> list[Float64]:
    """Return float64[B, 4] of each track: a joint's place, speed, load (each 1 wide), and way.

    The load is what the motion takes of the links. What drives the joint would not do: a controller
    answers a push, so that pushes would be alike in it and nothing else.
    """
    whole = [
        np.stack([each.q[:, joint], each.qd[:, joint], each.load[:, joint]], axis=1)
        for each in tracks
    ]
    spread = np.maximum(np.std(np.concatenate(whole), axis=0), 1e-12)
    ways = [np.sign(each.qd[:, joint : joint + 1]) for each in tracks]
    return [
        np.concatenate([each / spread, way], axis=1) for each, way in zip(whole, ways, strict=True)
    ]


def _follow_reversals(tracks: Sequence[Track], pushes: Sequence[Push], joint: int) -> bool:
    """Return whether pushes come after reversals of speed or load, more than by chance.

    A gear with play, or what sticks, lets go for a moment there.
    """
    if not pushes:
        return False
    near = [
        np.minimum(since_reversal(each.qd[:, joint]), since_reversal(each.load[:, joint])) < _AFTER
        for each in tracks
    ]
    chance = float(np.concatenate(near).mean())
    # What a push itself turns round comes after it begins.
    share = np.mean([near[each.track][max(each.piece.start - 2, 0)] for each in pushes])
    return float(share) > chance + 0.5 * (1.0 - chance)


def _recur(pushes: Sequence[Push], joint: int, recordings: int) -> bool:
    """Return whether a joint alone was pushed again and again, in most recordings.

    Someone who takes the hand pushes at many joints at once.
    """
    alone = [
        each
        for each in pushes
        if each.joint == joint and not any(_is_beside(each, other) for other in pushes)
    ]
    count = len({each.track for each in alone})
    return len(alone) >= _RECUR and count >= 3 and 2 * count > recordings


def _is_beside(one: Push, other: Push) -> bool:
    """Return whether pushes of two joints overlap."""
    is_there = one.track == other.track and one.joint != other.joint
    return is_there and one.begin < other.end and other.begin < one.end


def _goes_with_state(
    states: Sequence[Float64], torques: Sequence[Float64], number: int, piece: slice, size: float
) -> bool:
    """Return whether as much is missing at other times at which the joint was in the same state."""
    kept: list[Float64] = []
    missing: list[NDArray[np.bool_]] = []
    for index, (state, torque) in enumerate(zip(states, torques, strict=True)):
        is_other = np.ones(len(state), np.bool_)
        if index == number:
            near = 4 * _SMEARED
            is_other[max(piece.start - near, 0) : piece.stop + near] = False
        kept.append(state[is_other])
        missing.append(np.abs(torque[is_other]) > _QUIET * size)
    others, is_missing = np.concatenate(kept), np.concatenate(missing)
    if len(others) < _ALIKE:
        return False
    apart = np.sum((states[number][piece][:, None] - others[None]) ** 2, axis=2)
    nearest = np.argpartition(apart, _ALIKE - 1, axis=1)[:, :_ALIKE]
    return float(is_missing[nearest].mean()) >= _ELSEWHERE
