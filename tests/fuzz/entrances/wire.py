"""Everything that crosses the bus: each message type through the codec."""

import functools
import struct
import zlib
from pathlib import Path
from random import Random
from typing import Any

import msgpack

from shared.bus.base import NoAnswer, Refused
from shared.errors import MessageError
from shared.messages.message import Message
from shared.messages.topics import SERVICES, TOPICS
from shared.messages.wire import decode, encode
from tests.fuzz import mutate, trees, values
from tests.fuzz.target import MIB, Bound, Target

SAMPLES = 12
LIMIT = 8 << 20
KINDS: tuple[type[Message], ...] = tuple(
    sorted(
        {topic.message for topic in TOPICS}
        | {service.request for service in SERVICES}
        | {service.reply for service in SERVICES}
        | {Refused, NoAnswer},
        key=lambda kind: kind.__name__,
    )
)
"""What ``decode`` is asked for."""


def targets(_: Path) -> list[Target]:
    """Return one target for each message type."""
    return [
        Target(
            name=f"wire/{kind.__name__}",
            read=functools.partial(_read, kind),
            samples=tuple(encode(values.message(Random(seed), kind)) for seed in range(SAMPLES)),
            mutate=hostile,
            refusals=(MessageError,),
            covers=("shared.messages.wire:decode", "shared.messages.wire:_read_header"),
            bound=Bound(32, 8 * MIB),
        )
        for kind in KINDS
    ]


def _read(kind: type[Message], data: bytes) -> Message:
    return decode(kind, data, LIMIT)


def hostile(random: Random, data: bytes) -> bytes:
    """Break a payload: its bytes, or, with its checksum made right again, what is inside."""
    way = random.randrange(6)
    if way == 0:
        return mutate.raw(random, data)
    if way == 1:
        return sealed(mutate.raw(random, data[:4] + data[12:])[4:])
    length = struct.unpack_from("<I", data, 4)[0]
    header: dict[str, Any] = msgpack.unpackb(data[12 : 12 + length])
    body = bytearray(data[-(-(12 + length) // 8) * 8 :])
    if way == 2 and header["arrays"]:
        row = random.choice(header["arrays"])
        row[random.randrange(4)] = random.choice((
            "float64", "object", "bool", "int8", [1 << 28, 1 << 28], [], [1 << 30], [0] * 9, [-1],
            0, 8, -8, 2**63, 1 << 30, "", None,
        ))  # fmt: skip
    elif way == 3 and body:
        place = 4 * random.randrange(len(body) // 4 + 1)
        body[place : place + 4] = random.choice(
            (b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f", b"\xff\xff\xff\xff", b"\x02\x02\x02\x02")
        )
    elif way == 4 and header["arrays"]:
        random.choice((header["arrays"].pop, header["arrays"].reverse, body.clear))()
    else:
        inside = random.choice(("fields", "fields", "fields", "arrays"))
        if random.random() < 0.2:
            header = trees.changed(random, header)
        else:
            header[inside] = trees.changed(random, header[inside])
    return rebuilt(random, header, bytes(body))


def rebuilt(random: Random, header: Any, body: bytes) -> bytes:
    """Return a payload of this header with right length, padding and checksum."""
    try:
        packed = msgpack.packb(header, unicode_errors="surrogatepass")
    except OverflowError:  # a number that MessagePack has no room for
        packed = msgpack.packb({"schema": "", "v": 1, "fields": {}, "arrays": []})
    if random.random() < 0.05 and packed[:1] == b"\x84":  # a key twice
        packed = b"\x85" + packed[1:] + b"\xa1v\x01"
    packed = trees.nested(packed, b"\xad", b"\x91", b"", b"\xc0")
    pad = bytes(-(12 + len(packed)) % 8) if body else b""
    return sealed(packed, pad + body)


def sealed(header: bytes, rest: bytes = b"") -> bytes:
    """Return bytes as a payload whose length and checksum are right."""
    prefix = b"RPW\x01" + struct.pack("<I", len(header))
    crc = zlib.crc32(rest, zlib.crc32(header, zlib.crc32(prefix)))
    return prefix + struct.pack("<I", crc) + header + rest
