"""Bytes of characteristic 0x2A37, written the other way round than the parser under test."""


def measurement(
    rate: int,
    *,
    wide: bool = False,
    contact: bool | None = None,
    energy: int | None = None,
    intervals: tuple[int, ...] = (),
) -> bytes:
    """Return a heart rate measurement.

    Args:
        rate: beats per minute.
        wide: send it as uint16 even where uint8 would do.
        contact: with the skin; None for a strap that cannot tell.
        energy: in kJ; None for none.
        intervals: between beats, in 1/1024 s.
    """
    is_wide = wide or rate > 0xFF
    flags = int(is_wide)
    if contact is not None:
        flags |= 0b110 if contact else 0b100
    body = rate.to_bytes(2 if is_wide else 1, "little")
    if energy is not None:
        flags |= 0b1000
        body += energy.to_bytes(2, "little")
    if intervals:
        flags |= 0b10000
        body += b"".join(interval.to_bytes(2, "little") for interval in intervals)
    return bytes([flags]) + body
