"""Shows one sampled bout after the other in real time, although they are played much faster."""

import dataclasses
from collections import deque

import msgspec
import numpy as np

from shared.messages.live import BoutFrames
from shared.telemetry.bout import BoutRows

START_STEPS = 100
"""A bout whose first frames came later than this is joined only when there is nothing to show."""
STARVED_SECONDS = 1.0
"""A bout that got no frames for this long gives way to the next one."""


@dataclasses.dataclass
class _Bout:
    """Frames of one bout that wait to be shown."""

    first: BoutFrames
    parts: deque[BoutFrames] = dataclasses.field(default_factory=deque[BoutFrames])
    last_step: int = -1
    """Of the frames that were kept; the next must come later."""

    def holds(self, frames: BoutFrames) -> bool:
        return _key(self.first) == _key(frames)


class Playback:
    """Paces sampled bouts; holds at most the bout on show and the one after it."""

    def __init__(self, control_timestep: float, frames_per_second: float, bout_steps: int) -> None:
        self._timestep = control_timestep
        self._stride = max(1, round(1.0 / (frames_per_second * control_timestep)))
        self._bout_steps = bout_steps
        self._shown: _Bout | None = None
        self._next: _Bout | None = None
        self._started: BoutFrames | None = None
        self._now = 0.0
        self._cursor = 0.0
        """Control step of the bout on show that is due now."""
        self._base = 0
        """Control steps of all bouts shown before."""
        self._last = 0
        self._starved = 0.0

    @property
    def waiting_frames(self) -> int:
        """Return how many frames are held."""
        bouts = [bout for bout in (self._shown, self._next) if bout is not None]
        return sum(len(part.steps) for bout in bouts for part in bout.parts)

    def offer(self, frames: BoutFrames) -> bool:
        """Take frames in; return whether they can still come to be shown."""
        if len(frames.steps) == 0:
            return False
        for bout in (self._shown, self._next):
            if bout is not None and bout.holds(frames):
                return self._append(bout, frames)
        begins = int(frames.steps[0]) <= START_STEPS
        if self._shown is None:
            self._shown = _Bout(frames)
            self._begin(self._shown)
            return self._append(self._shown, frames)
        if begins:
            self._next = _Bout(frames)
            return self._append(self._next, frames)
        return False

    def take_started(self) -> BoutFrames | None:
        """Return the first frames of a bout that has come on show since the last call."""
        started, self._started = self._started, None
        return started

    def due(self, now: float, wall_ns: int) -> BoutRows | None:
        """Return what is to be shown since the last call, or None.

        Args:
            now: the monotonic clock (s).
            wall_ns: the wall clock at that instant.
        """
        elapsed, self._now = max(0.0, now - self._now) if self._now else 0.0, now
        if self._shown is None:
            return None
        if not self._shown.parts:
            self._starved += elapsed
            over = self._last >= self._bout_steps - 2 * self._stride
            if self._next is not None and (over or self._starved > STARVED_SECONDS):
                self._base += self._last + self._stride
                self._shown, self._next = self._next, None
                self._begin(self._shown)
            return None
        self._starved = 0.0
        self._cursor += elapsed / self._timestep
        return self._take(self._shown, wall_ns)

    def _begin(self, bout: _Bout) -> None:
        self._cursor = float(bout.first.steps[0])
        self._last = int(bout.first.steps[0])
        self._starved = 0.0
        self._started = bout.first

    def _append(self, bout: _Bout, frames: BoutFrames) -> bool:
        kept: list[int] = []
        for k, step in enumerate(frames.steps.tolist()):
            if bout.last_step < 0 or step >= bout.last_step + self._stride:
                kept.append(k)
                bout.last_step = step
        if kept:
            bout.parts.append(_thin(frames, kept))
        return True

    def _take(self, bout: _Bout, wall_ns: int) -> BoutRows | None:
        rows: list[BoutRows] = []
        while bout.parts:
            part = bout.parts[0]
            count = int(np.searchsorted(part.steps, self._cursor, side="right"))
            if count:
                rows.append(self._rows(part, count, wall_ns))
                self._last = int(part.steps[count - 1])
            if count < len(part.steps):
                bout.parts[0] = _pick(part, slice(count, None))
                break
            bout.parts.popleft()
        if not bout.parts:  # the next frames go on from here, however late they come
            self._cursor = min(self._cursor, float(self._last))
        return BoutRows.join(rows) if rows else None

    def _rows(self, part: BoutFrames, count: int, wall_ns: int) -> BoutRows:
        steps = part.steps[:count].astype(np.int64)
        late = np.round((self._cursor - steps) * self._timestep * 1e9).astype(np.int64)
        return BoutRows(
            control_step=self._base + steps,
            wall_ns=wall_ns - late,
            positions=part.positions[:count],
            quaternions=part.quaternions[:count],
            joints=part.joints[:count],
            score=part.score[:count],
            in_target=part.in_target[:count],
            contact=part.contact[:count],
        )


def _key(frames: BoutFrames) -> tuple[str, str, int]:
    return frames.actor, frames.lease, frames.bout


def _thin(frames: BoutFrames, kept: list[int]) -> BoutFrames:
    """Keep some instants; what happened between two of them counts for the later one."""
    if len(kept) == len(frames.steps):
        return frames
    starts = [0, *(k + 1 for k in kept[:-1])]
    end = kept[-1] + 1
    return msgspec.structs.replace(
        _pick(frames, kept),
        in_target=np.logical_or.reduceat(frames.in_target[:end], starts, axis=0),
        contact=np.logical_or.reduceat(frames.contact[:end], starts),
    )


def _pick(frames: BoutFrames, which: "list[int] | slice") -> BoutFrames:
    return msgspec.structs.replace(
        frames,
        steps=frames.steps[which],
        positions=frames.positions[which],
        quaternions=frames.quaternions[which],
        joints=frames.joints[which],
        score=frames.score[which],
        in_target=frames.in_target[which],
        contact=frames.contact[which],
    )
