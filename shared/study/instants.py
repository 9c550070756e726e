"""Instants of the wall clock, as text and as numbers, and whether a clock can be right."""

import datetime
import math
from typing import Final

MAX_BACK: Final = 2.0
"""What a wall clock may have gone back since the last event (s): a correction over the network."""
_FIRST_YEAR: Final = 2024
_EARLIEST_NS: Final = int(datetime.datetime(_FIRST_YEAR, 1, 1, tzinfo=datetime.UTC).timestamp()) * (
    10**9
)
_LATEST_NS: Final = 10**9 * 253_402_300_799
"""The year 9999."""


def text_of(wall_ns: int) -> str:
    """Return an instant as ISO 8601 in UTC, to the microsecond: ``2026-11-21T16:43:47.123456Z``.

    Raises:
        ValueError: it is not in the years 1970 to 9999.
    """
    if not 0 <= wall_ns <= _LATEST_NS:
        raise ValueError(f"{wall_ns} ns is no instant of the years 1970 to 9999")
    seconds, ns = divmod(wall_ns, 10**9)
    whole = datetime.datetime.fromtimestamp(seconds, datetime.UTC)
    return f"{whole:%Y-%m-%dT%H:%M:%S}.{ns // 1000:06d}Z"


def clock_problem(now_ns: int, last_ns: int) -> str | None:
    """Return what is wrong with the wall clock, None where it may be right.

    Args:
        now_ns: what it shows.
        last_ns: what it showed at the last event; 0 where there was none.
    """
    if now_ns < _EARLIEST_NS:
        return (
            f"the clock of this machine shows {text_of(max(now_ns, 0))[:10]}: set it "
            "(timedatectl), for every row is dated by it"
        )
    back = (last_ns - now_ns) / 1e9
    if back > MAX_BACK:
        return (
            f"the clock of this machine shows {text_of(now_ns)}, {spoken(back)} before the last "
            f"event ({text_of(min(last_ns, _LATEST_NS))}): set it right (timedatectl); where it is "
            "right now and was wrong then, this session cannot be gone on with"
        )
    return None


def spoken(seconds: float) -> str:
    """Return a length of time as people say it: ``3.0 h``."""
    if seconds < 120.0:
        return f"{seconds:.1f} s"
    return f"{math.floor(seconds / 60.0)} min" if seconds < 7200.0 else f"{seconds / 3600.0:.1f} h"
