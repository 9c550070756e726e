"""Broken bytes from valid ones, whatever their format; every choice is the ``Random``'s."""

import struct
from random import Random

NUMBERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0xFFFF, 1 << 24, 1 << 30, 0x7FFFFFFF, 0x80000000,
           0xFFFFFFFF, 1 << 40, 0x7FFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF)  # fmt: skip
"""Lengths that somebody may believe: 1 GiB, and the edges of every width."""
TEXTS = (
    b"\xff\xfe", b"\xed\xa0\x80", b"\xc0\x80", b"\xf4\x90\x80\x80", b"\x00", b"%s%n", b"\r\n",
    b"../../../etc/passwd", b"\xef\xbb\xbf", b"\xe2\x80\xae", b"nan", b"-1", b"1e999",
)  # fmt: skip
"""Broken UTF-8 (lone surrogate, overlong, beyond Unicode), and what upsets readers of text."""
LARGEST = 1 << 20
"""Bytes of a mutated input."""


def size_of(random: Random, most: int) -> int:
    """Return a size from 1 to ``most``, small ones as likely as large ones."""
    return min(most, 1 + (random.getrandbits(16) >> random.randrange(16)) * max(1, most >> 16))


def raw(random: Random, data: bytes) -> bytes:
    """Return the bytes after one to four blows that know nothing of their meaning."""
    broken = bytearray(data)
    for _ in range(random.choice((1, 1, 1, 2, 4))):
        random.choice(_BLOWS)(random, broken)
    return bytes(broken[:LARGEST])


def _place(random: Random, data: bytearray) -> int:
    return random.randrange(len(data) + 1)


def _flip(random: Random, data: bytearray) -> None:
    for _ in range(random.choice((1, 1, 8))):
        if data:
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)


def _set(random: Random, data: bytearray) -> None:
    if data:
        data[random.randrange(len(data))] = random.getrandbits(8)


def _number(random: Random, data: bytearray) -> None:
    """Write a number of 2, 4 or 8 bytes over others: a length field, perhaps."""
    kind = random.choice(("<H", "<I", "<I", "<Q", ">I"))
    width = struct.calcsize(kind)
    place = random.choice((0, 4, 8, _place(random, data), _place(random, data)))
    mask = (1 << 8 * width) - 1
    data[place : place + width] = struct.pack(kind, random.choice(NUMBERS) & mask)


def _truncate(random: Random, data: bytearray) -> None:
    del data[_place(random, data) :]


def _extend(random: Random, data: bytearray) -> None:
    size = size_of(random, 1 << 12)
    data += random.choice((bytes(size), b"\xff" * size, bytes(data[:size]), random.randbytes(size)))


def _cut(random: Random, data: bytearray) -> None:
    start = _place(random, data)
    del data[start : start + size_of(random, 64)]


def _repeat(random: Random, data: bytearray) -> None:
    start = _place(random, data)
    piece = bytes(data[start : start + size_of(random, 256)])
    data[start:start] = piece * random.choice((1, 1, 2, 50))


def _text(random: Random, data: bytearray) -> None:
    place = _place(random, data)
    word = random.choice(TEXTS)
    data[place : place + random.choice((0, len(word)))] = word


def _run(random: Random, data: bytearray) -> None:
    """Put a long run of one byte in: spaces and brackets hang naive patterns and parsers."""
    place = _place(random, data)
    data[place:place] = bytes([random.choice(b' [{("\n\x00\xff9')]) * size_of(random, 1 << 15)


_BLOWS = (_flip, _flip, _set, _number, _number, _truncate, _extend, _cut, _repeat, _text, _run)
