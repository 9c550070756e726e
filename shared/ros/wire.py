"""TCPROS as bytes: a length, then a header of ``name=value`` fields or a message."""

from collections.abc import Mapping
from typing import Final

from shared.errors import MessageError

LENGTH: Final = 4
"""Bytes of the number in front of everything, little-endian."""
LARGEST_HEADER: Final = 64 << 10
"""Bytes; a definition of a message's type is the longest field there is."""
LARGEST_MESSAGE: Final = 4 << 20
"""Bytes; a larger one ends the connection before anything of it is kept."""


def framed(data: bytes) -> bytes:
    """Return the bytes behind their length."""
    return len(data).to_bytes(LENGTH, "little") + data


def length_of(data: bytes | bytearray | memoryview, limit: int) -> int:
    """Return the number in four bytes.

    Raises:
        MessageError: it is over the limit.
    """
    length = int.from_bytes(data, "little")
    if length > limit:
        raise MessageError(f"{length} bytes announced, at most {limit} are taken")
    return length


def header(fields: Mapping[str, str]) -> bytes:
    """Return a header's bytes, its length in front."""
    return framed(b"".join(framed(f"{name}={value}".encode()) for name, value in fields.items()))


def fields_of(data: bytes) -> dict[str, str]:
    """Return the fields of a header, given without its length.

    Raises:
        MessageError: the bytes are no header.
    """
    fields: dict[str, str] = {}
    position = 0
    while position < len(data):
        start = position + LENGTH
        end = start + length_of(data[position:start], len(data))
        name, equals, value = data[start:end].partition(b"=")
        if start > len(data) or end > len(data) or not equals or not name:
            raise MessageError(f"{len(data)} bytes are no TCPROS header")
        fields[name.decode("utf-8", "replace")] = value.decode("utf-8", "replace")
        position = end
    return fields
