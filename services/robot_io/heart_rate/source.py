"""The heart rate of the person who plays: section ``[heart_rate]``, and what becomes of it.

A source hands over measurements; the feed publishes them on ``play/heart_rate``, and notes when
none come. Nothing gates safety on a heart rate.
"""

from pathlib import Path
from typing import Literal, Protocol

import msgspec
import structlog

from shared.bus.base import Bus
from shared.clock import Clock
from shared.config.ranges import check_ordered, check_ranges
from shared.errors import ConfigError
from shared.messages.play import HeartRate
from shared.messages.topics import HEART_RATE

LEAST_BPM, MOST_BPM = 20.0, 300.0
"""Straps send 0 while they find no beat; what lies outside is no heart rate."""
LEAST_RR_MS, MOST_RR_MS = 150.0, 3500.0
TAKE_MOST = 16
"""Measurements taken in one tick."""

log = structlog.get_logger()


class HeartRateConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The heart rate of the person who plays."""

    source: Literal["none", "ble", "replay"] = "none"
    """A Bluetooth strap, a recording, or none."""
    address: str = ""
    """Of the strap: A0:9E:1A:00:00:01; empty for any that matches the name."""
    name: str = ""
    """What the strap's name contains; empty, with no address, for the first strap found."""
    file: str = ""
    """Recording: .csv or .tsv with columns seconds, beats_per_minute and perhaps rr_ms, or .npy
    float64[T, 2]."""
    stale_after: float = 5.0
    """Without a measurement for so long there is a gap, which is counted and logged (s)."""
    silent_after: float = 10.0
    """A strap that is connected and says nothing for so long is connected anew (s)."""
    search_seconds: float = 10.0
    """Longest search for the strap, and longest wait for a connection (s)."""
    retry_first: float = 1.0
    """Wait before the second try to connect; it doubles with each that fails (s)."""
    retry_longest: float = 30.0
    """Longest wait between two tries (s)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        check_ranges(
            self,
            ("stale_after", 1.0, 60.0), ("silent_after", 1.0, 600.0),
            ("search_seconds", 0.5, 120.0), ("retry_first", 0.05, 60.0),
            ("retry_longest", 0.05, 600.0),
        )  # fmt: skip
        check_ordered(self, ("retry_first", "retry_longest"))
        if (self.source == "replay") != bool(self.file):
            raise ValueError(
                f"source is {self.source!r} and file is {self.file!r}: "
                "give a file with source = 'replay', and only there"
            )


class Beat(msgspec.Struct, frozen=True, kw_only=True):
    """One measurement, as it came."""

    at: float
    """When it arrived, by our monotonic clock (s)."""
    at_ns: int
    """The same by the wall clock."""
    beats_per_minute: float
    rr_ms: tuple[float, ...] = ()
    contact: bool = True


class HeartRateSource(Protocol):
    """Where measurements come from; nothing here may block."""

    name: str
    """Of the device or the recording, for the record."""

    def take(self, now: float) -> Beat | None:
        """Return the oldest measurement that was not taken, or None."""
        ...

    def counters(self) -> dict[str, int]:
        """Return what it has counted since the start."""
        ...

    @property
    def problem(self) -> str:
        """Return why nothing can come now; empty when it can."""
        ...

    def close(self) -> None:
        """Let go of the device."""
        ...


class HeartRateFeed:
    """Publishes measurements and notes gaps; the loop ticks it."""

    def __init__(self, source: HeartRateSource, stale_after: float, bus: Bus) -> None:
        """Take over the source.

        Args:
            source: it is closed with this.
            stale_after: without a measurement for so long there is a gap (s).
            bus: this process's end of the bus.
        """
        self._source = source
        self._stale_after = stale_after
        self._bus = bus
        self._last: Beat | None = None
        self._is_stale = False
        self._age = 0.0
        self._counters = {
            "heart_rate_measurements": 0,
            "heart_rate_unusable": 0,
            "heart_rate_gaps": 0,
        }

    def tick(self, now: float) -> None:
        """Publish what has come; notice that nothing has."""
        for _ in range(TAKE_MOST):
            if (beat := self._source.take(now)) is None:
                break
            self._publish(beat)
        if self._last is None:
            return
        self._age = now - self._last.at
        if not self._is_stale and self._age > self._stale_after:
            self._is_stale = True
            self._counters["heart_rate_gaps"] += 1
            log.warning("heart_rate_gap_began", seconds=round(self._age, 1))

    def _publish(self, beat: Beat) -> None:
        if not LEAST_BPM <= beat.beats_per_minute <= MOST_BPM:  # also refuses NaN
            self._counters["heart_rate_unusable"] += 1
            return
        if self._is_stale and self._last is not None:
            self._is_stale = False
            log.info("heart_rate_gap_ended", seconds=round(beat.at - self._last.at, 1))
        self._last = beat
        self._counters["heart_rate_measurements"] += 1
        intervals = tuple(rr for rr in beat.rr_ms if LEAST_RR_MS <= rr <= MOST_RR_MS)
        message = HeartRate(
            at_ns=beat.at_ns,
            beats_per_minute=beat.beats_per_minute,
            rr_ms=intervals,
            contact=beat.contact,
            source=self._source.name,
        )
        self._bus.publish(HEART_RATE, message)

    def rates(self) -> dict[str, float]:
        """Return the last heart rate while it is fresh, and its age."""
        if self._last is None:
            return {}
        fresh = {} if self._is_stale else {"heart_rate_bpm": self._last.beats_per_minute}
        return {**fresh, "heart_rate_age_s": self._age}

    def counters(self) -> dict[str, int]:
        """Return measurements, gaps, and what the source counted."""
        return {**self._counters, **self._source.counters()}

    @property
    def problem(self) -> str:
        """Return why there is no heart rate now; empty when there is."""
        if self._source.problem:
            return f"heart rate: {self._source.problem}"
        if self._is_stale:
            return f"heart rate: no measurement for {self._age:.0f} s; look at the strap"
        return ""

    def close(self) -> None:
        """Let go of the source."""
        self._source.close()


def open_heart_rate(cfg: HeartRateConfig, bus: Bus, clock: Clock) -> HeartRateFeed | None:
    """Return what the settings ask for; None for no heart rate.

    Raises:
        ConfigError: a recording cannot be read, or bleak is not installed.
    """
    source: HeartRateSource
    if cfg.source == "ble":
        try:  # bleak only where it is asked for
            from services.robot_io.heart_rate.ble import BleStrap
        except ImportError as error:
            raise ConfigError(
                f"heart_rate.source is 'ble', which needs bleak ({error}): "
                "`pip install riposte[robot]`, or set it to 'none'"
            ) from error
        source = BleStrap(cfg, clock)
    elif cfg.source == "replay":
        from services.robot_io.heart_rate.replay import HeartRateReplay

        source = HeartRateReplay.load(Path(cfg.file), clock)
    else:
        return None
    return HeartRateFeed(source, cfg.stale_after, bus)
