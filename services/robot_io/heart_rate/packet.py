"""The bytes of a heart rate measurement: characteristic 0x2A37 of the Bluetooth Heart Rate Service.

One byte of flags, the rate as uint8 or uint16, then what the flags announce: energy as uint16 and
intervals between beats as uint16 in 1/1024 s, all little-endian. Nothing may be left over.
"""

import struct

import msgspec

from shared.errors import MessageError

WIDE_RATE = 0x01
CONTACT_KNOWN = 0x04
CONTACT = 0x02
ENERGY = 0x08
INTERVALS = 0x10
INTERVAL_MS = 1000.0 / 1024.0
MAX_BYTES = 512
"""Longest value of any characteristic."""


class Packet(msgspec.Struct, frozen=True, kw_only=True):
    """One notification of a strap."""

    beats_per_minute: int
    contact: bool | None = None
    """Whether it touches the skin; None where it cannot tell."""
    energy_kj: int | None = None
    """Spent since the strap was reset (kJ), where it says so."""
    rr_ms: tuple[float, ...] = ()
    """Intervals between beats (ms), oldest first."""


def parse(value: bytes | bytearray) -> Packet:
    """Return what the bytes say.

    Raises:
        MessageError: too short or too long for what their flags announce.
    """
    size = len(value)
    if not 2 <= size <= MAX_BYTES:
        raise MessageError(f"a heart rate of {size} bytes; 2 to {MAX_BYTES} are possible")
    flags = value[0]
    head = "<xH" if flags & WIDE_RATE else "<xB"
    head += "H" if flags & ENERGY else ""
    start = struct.calcsize(head)
    left = size - start
    if left < 0 or (left and not flags & INTERVALS) or left % 2:
        raise MessageError(
            f"a heart rate of {size} bytes with flags 0x{flags:02x}; expected {start}"
            + (" and two for each interval" if flags & INTERVALS else "")
        )
    rate, *energy = struct.unpack_from(head, value)
    intervals = struct.unpack_from(f"<{left // 2}H", value, start)
    return Packet(
        beats_per_minute=rate,
        contact=bool(flags & CONTACT) if flags & CONTACT_KNOWN else None,
        energy_kj=energy[0] if energy else None,
        rr_ms=tuple(INTERVAL_MS * interval for interval in intervals),
    )
