"""The heart rate of a session: rows of ``hr.tsv`` as they come, and the mean of a baseline."""

import dataclasses
import math
from collections import deque
from collections.abc import Iterable

from services.study.plan import SessionPlan
from shared.clock import Clock
from shared.messages.play import HeartRate
from shared.study.instants import text_of
from shared.study.progress import Progress
from shared.study.rows import HeartRateRow
from shared.study.steps import Step
from shared.study.tsv import RowLog

RECENT_SECONDS = 120
"""What a page draws."""
SYNC_SECONDS = 1.0
"""A killed machine loses no more of the heart rate than this (s)."""


@dataclasses.dataclass
class Window:
    """The measurements of a stretch of time."""

    began_at: float = math.inf
    """By the monotonic clock (s)."""
    beats: int = 0
    """Measurements, with skin at the sensor."""
    total: float = 0.0
    """Their sum (1/min)."""

    def add(self, beats: Iterable[HeartRate]) -> None:
        """Take measurements in."""
        for beat in beats:
            if beat.contact:
                self.beats += 1
                self.total += beat.beats_per_minute

    @property
    def beats_per_minute(self) -> float | None:
        """Return their mean, None without any."""
        return self.total / self.beats if self.beats else None


class HeartLog:
    """Writes measurements down where the session stood when they came, and keeps the latest."""

    def __init__(self, plan: SessionPlan, log: RowLog, clock: Clock) -> None:
        """Begin.

        Args:
            plan: names the participant and the blinded labels.
            log: the table; it is closed with this.
            clock: dates the rows.
        """
        self._plan = plan
        self._log = log
        self._clock = clock
        self._sync_at = self._next_at = clock.now()
        self._is_synced = True
        self.recent: deque[float | None] = deque(maxlen=RECENT_SECONDS)
        """One value a second, newest last; None where there was none."""
        self.rows = 0
        """Written by this process."""

    def add(
        self, beats: Iterable[HeartRate], step: Step | None, progress: Progress,
        now_bpm: float | None,
    ) -> None:  # fmt: skip
        """Write measurements down, none before the consent and none of warm-up games.

        Args:
            beats: that have come.
            step: that is on; None outside the session, when nothing is kept.
            progress: of the session.
            now_bpm: the rate to draw.

        Raises:
            RiposteError: the table cannot be written.
        """
        now = self._clock.now()
        if now >= self._next_at:
            self._next_at = max(self._next_at + 1.0, now)
            self.recent.append(now_bpm)
        is_on = step is not None and progress.begun == step.id and progress.has_consent
        if step is not None and is_on and step.kind != "warm_up":
            for beat in beats:
                self._log.write(self._row(beat, step, progress))
                self.rows += 1
                self._is_synced = False
        if not self._is_synced and now >= self._sync_at:
            self._log.sync()
            self._is_synced, self._sync_at = True, now + SYNC_SECONDS

    def close(self) -> None:
        """Make everything durable and let go of the table."""
        self._log.sync()
        self._log.close()

    def _row(self, beat: HeartRate, step: Step, progress: Progress) -> HeartRateRow:
        running = progress.running
        is_playing = running is not None and running[0] == step.id
        return HeartRateRow(
            participant=self._plan.participant,
            session=self._plan.session,
            t_ns=round(1e9 * self._clock.now()),
            wall=text_of(beat.at_ns),
            bpm=beat.beats_per_minute,
            contact=beat.contact,
            step=step.id,
            section=step.section,
            condition=self._plan.label(step),
            game=step.game if is_playing else 0,
            attempt=running[1].number if running is not None and is_playing else 0,
            source=beat.source,
            policy=running[1].start.policy if running is not None and is_playing else "",
            config=progress.config,
        )
