"""LATEST values of one writer: what was sent last under each key, and when to send it again."""

import dataclasses

from shared.errors import MessageError

MAX_STAMP = 64
"""Longest stamp (bytes)."""


@dataclasses.dataclass
class Sent:
    """A value as it was sent, and when."""

    key: str
    payload: bytes
    stamp: bytes
    at: float


class LatestSent:
    """The newest value of every key, until replaced."""

    def __init__(self, period: float) -> None:
        """Remember nothing yet; ``period`` is the time (s) after which a value is due again."""
        self._period = period
        self._sent: dict[str, Sent] = {}

    def keep(self, key: str, payload: bytes, stamp: bytes, now: float) -> None:
        """Remember a value that is being sent."""
        self._sent[key] = Sent(key, payload, stamp, now)

    def due(self, now: float) -> list[Sent]:
        """Return what was not sent for a period, and take it as sent now."""
        due = [sent for sent in self._sent.values() if now - sent.at >= self._period]
        for sent in due:
            sent.at = now
        return due

    def all(self) -> list[Sent]:
        """Return every value."""
        return list(self._sent.values())


def stamp_of(boot: str, count: int) -> bytes:
    """Return what tells a value from the same one sent again: its writer and its number there."""
    return f"{boot}:{count}".encode("ascii")


def read_stamp(stamp: bytes) -> tuple[str, int]:
    """Return the writer's boot and the number.

    Raises:
        MessageError: it is not a stamp.
    """
    boot, _, count = stamp[:MAX_STAMP].decode("ascii", "replace").partition(":")
    if len(stamp) > MAX_STAMP or not boot or not (count.isascii() and count.isdigit()):
        raise MessageError(f"a value has the stamp {stamp[:MAX_STAMP]!r}, expected boot:count")
    return boot, int(count)
