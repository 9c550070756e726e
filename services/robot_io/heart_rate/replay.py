"""A recorded heart rate, played again from the first tick on, over and over."""

import csv
import math
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from services.robot_io.heart_rate.source import Beat
from shared.clock import Clock
from shared.errors import ConfigError
from shared.runtime.arrays import read_array

MAX_ROWS = 1_000_000
LAST_SECONDS = 1.0
"""From the last measurement to the first of the next time round."""

Floats = NDArray[np.float64]


class HeartRateReplay:
    """Measurements of a recording at their own times."""

    def __init__(
        self, name: str, rows: Floats, intervals: list[tuple[float, ...]], clock: Clock
    ) -> None:
        """Take a recording that was checked.

        Args:
            name: of the recording, for the record.
            rows: float64[T, 2], time (s, rising) and beats per minute.
            intervals: T tuples of intervals between beats (ms).
            clock: says when a measurement was handed over.
        """
        self.name = name
        self._times = rows[:, 0] - rows[0, 0]
        self._beats = rows[:, 1]
        self._intervals = intervals
        self._clock = clock
        self._began_at: float | None = None
        self._next = 0

    @staticmethod
    def load(path: Path, clock: Clock) -> "HeartRateReplay":
        """Read a recording.

        Raises:
            ConfigError: the file cannot be read, or is no recording of a heart rate.
        """
        intervals: list[tuple[float, ...]] | None = None
        try:
            if path.suffix == ".npy":
                rows = read_array(path)
            else:
                rows, intervals = _read_table(path)
        except (OSError, ValueError, TypeError, KeyError, csv.Error) as error:
            raise ConfigError(f"cannot read the recorded heart rate {path}: {error}") from error
        if rows.ndim != 2 or rows.shape[1] != 2 or not 1 <= len(rows) <= MAX_ROWS:
            raise ConfigError(
                f"{path} has the shape {rows.shape}, expected [T, 2] with T of 1 to {MAX_ROWS}: "
                "a time (s) and beats per minute"
            )
        if not np.isfinite(rows).all() or np.any(np.diff(rows[:, 0]) <= 0.0):
            raise ConfigError(f"{path} has a number that is not finite, or times that do not rise")
        return HeartRateReplay(path.name, rows, intervals or [()] * len(rows), clock)

    def take(self, now: float) -> Beat | None:
        """Return the next measurement once its time has come."""
        if self._began_at is None:
            self._began_at = now
        if self._next == len(self._times):
            self._began_at += float(self._times[-1]) + LAST_SECONDS
            self._next = 0
        row = self._next
        if now - self._began_at < self._times[row]:
            return None
        self._next += 1
        return Beat(
            at=now,
            at_ns=self._clock.wall_ns(),
            beats_per_minute=float(self._beats[row]),
            rr_ms=self._intervals[row],
        )

    def counters(self) -> dict[str, int]:
        """Return nothing: a recording has no trouble of its own."""
        return {}

    @property
    def problem(self) -> str:
        """Return no problem."""
        return ""

    def close(self) -> None:
        """Nothing to let go of."""


def _read_table(path: Path) -> tuple[Floats, list[tuple[float, ...]]]:
    """Return time and rate float64[T, 2] of a table with a header, and the intervals of each row.

    Raises:
        ValueError: a cell is no number, a column is missing, or there are too many rows.
    """
    numbers: list[tuple[float, float]] = []
    intervals: list[tuple[float, ...]] = []
    with path.open(newline="", encoding="utf-8") as file:
        table = csv.DictReader(file, delimiter="\t" if path.suffix == ".tsv" else ",", strict=True)
        for column in ("seconds", "beats_per_minute"):
            if column not in (table.fieldnames or ()):
                raise ValueError(f"no column {column!r} in its first line")
        for row in table:
            if len(numbers) == MAX_ROWS:
                raise ValueError(f"more than {MAX_ROWS} rows")
            numbers.append((_number(row["seconds"]), _number(row["beats_per_minute"])))
            intervals.append(tuple(_number(word) for word in (row.get("rr_ms") or "").split()))
    return np.array(numbers, np.float64).reshape(-1, 2), intervals


def _number(word: str | None) -> float:
    number = float(word or "nan")
    if not math.isfinite(number):
        raise ValueError(f"{word!r} is not a number")
    return number
