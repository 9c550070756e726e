"""What a browser may say: poses as numbers, wishes as JSON; checked here, once.

Binary: little-endian float64[6], ``sequence, x, y, z, roll, is_valid``. The sequence counts from 0
and never goes back; x, y, z is where the bat's tip is wanted in the world (m); roll turns the bat
about the way it points (rad); is_valid is 1, or 0 when the page cannot see the pointer.
Text: one ``Ask``.
"""

import math
import struct
from typing import Literal

import msgspec

from shared.errors import MessageError

MAX_BYTES = 1024
"""Nothing longer is read."""
LARGEST_M = 100.0
MAX_SEQUENCE = 2**53
"""A float64 counts no further."""

_POINTER = struct.Struct("<6d")
_NAMES = ("sequence", "x", "y", "z", "roll", "is_valid")


class Pointer(msgspec.Struct, frozen=True, kw_only=True, gc=False):
    """Where a page wants the bat."""

    session: int
    """Of the page that said it."""
    sequence: int
    tip: tuple[float, float, float]
    """World frame (m)."""
    roll: float
    """rad, in -pi .. pi."""
    is_valid: bool


class BoutAsk(msgspec.Struct, frozen=True, tag="bout", forbid_unknown_fields=True):
    """The next step in the course of a bout."""

    action: Literal["start", "pause", "resume", "abandon"]


class GateAsk(msgspec.Struct, frozen=True, tag="gate", forbid_unknown_fields=True):
    """A person's click on arm, disarm or reset."""

    action: Literal["arm", "disarm", "reset"]


class PlayerAsk(msgspec.Struct, frozen=True, tag="player", forbid_unknown_fields=True):
    """Who plays opposite from the next bout on, by the name in the list."""

    name: str


class StatsAsk(msgspec.Struct, frozen=True, tag="stats", forbid_unknown_fields=True):
    """What the page measured of itself in the last second."""

    frames_per_s: float
    latency_p50_ms: float
    """From a pointer's event to the first bat state made of it, back in the page; 0 unknown."""
    latency_p90_ms: float


Ask = BoutAsk | GateAsk | PlayerAsk | StatsAsk
_ASKS = msgspec.json.Decoder(Ask)


def parse_pointer(data: bytes, session: int, last: int) -> Pointer:
    """Return a pose from the bytes of one binary message.

    Args:
        data: the message.
        session: of the page it came from.
        last: the sequence before it, -1 for none.

    Raises:
        MessageError: it is none; says which number is wrong.
    """
    if len(data) != _POINTER.size:
        raise MessageError(f"a pose has {len(data)} bytes, expected {_POINTER.size} (6 float64)")
    values = _POINTER.unpack(data)
    for name, value in zip(_NAMES, values, strict=True):
        if not math.isfinite(value):
            raise MessageError(f"{name} of a pose is {value}, expected a finite number")
    sequence, x, y, z, roll, is_valid = values
    if sequence != int(sequence) or not last < sequence < MAX_SEQUENCE:
        raise MessageError(f"sequence of a pose is {sequence:g}, expected a count above {last}")
    if max(abs(x), abs(y), abs(z)) > LARGEST_M:
        raise MessageError(f"a pose is at {x:g}, {y:g}, {z:g} m, expected within {LARGEST_M:g} m")
    if is_valid not in (0.0, 1.0):
        raise MessageError(f"is_valid of a pose is {is_valid:g}, expected 0 or 1")
    return Pointer(
        session=session,
        sequence=int(sequence),
        tip=(x, y, z),
        roll=math.remainder(roll, math.tau),
        is_valid=is_valid == 1.0,
    )


def parse_ask(text: str) -> Ask:
    """Return what one text message asks for.

    Raises:
        MessageError: it is no such wish; says why.
    """
    try:
        ask = _ASKS.decode(text)
    except (ValueError, RecursionError) as error:
        raise MessageError(f"a wish cannot be read: {error}") from None
    if isinstance(ask, StatsAsk):
        for name in ask.__struct_fields__:
            value = getattr(ask, name)
            if not (math.isfinite(value) and 0.0 <= value <= 1e6):
                raise MessageError(f"{name} is {value}, expected 0 to 1e6")
    return ask
