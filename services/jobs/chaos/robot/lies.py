"""Answers that a policy may send with its own certificate, and that are wrong or mean harm."""

from collections.abc import Callable

import msgspec
import numpy as np

from shared.messages.play import DesiredOffset
from shared.policy.action import ActionConfig

HUGE = 10_000
"""Characters of a name, in a message that may have 4 KiB."""
BIT = 0x55

Lie = Callable[[DesiredOffset], DesiredOffset]


def with_offset(answer: DesiredOffset, *numbers: float) -> DesiredOffset:
    """Return the answer with another offset: numbers for all six, over and over."""
    return msgspec.structs.replace(answer, offset=np.resize(np.array(numbers), 6))


def to_and_fro(answer: DesiredOffset) -> DesiredOffset:
    """Return the largest offset there is, in turn one way and the other with every tick."""
    return with_offset(answer, (-1.0) ** answer.tick * ActionConfig().offset_bound_m)


LIES: dict[str, Lie] = {
    "not a number": lambda it: with_offset(it, np.nan, 0.0),
    "infinite": lambda it: with_offset(it, 0.0, -np.inf),
    "beyond all bounds": lambda it: with_offset(it, 1e300),
    "a metre off": lambda it: with_offset(it, 1.0, -1.0, 0.5),
    "to and fro": to_and_fro,
    "of a tick to come": lambda it: msgspec.structs.replace(it, tick=it.tick + 1000),
    "of a tick long past": lambda it: msgspec.structs.replace(it, tick=max(it.tick - 500, 0)),
    "to another robot_io": lambda it: msgspec.structs.replace(it, boot="0" * len(it.boot)),
    "as the other side": lambda it: msgspec.structs.replace(it, agent="antagonist"),
    "sent again": lambda it: it,
    "damaged bytes": lambda it: it,
    "huge": lambda it: msgspec.structs.replace(it, snapshot="x" * HUGE),
}
"""By name; each takes the protagonist's true answer to a tick."""


def damaged(payload: bytes) -> bytes:
    """Return a message with four bytes in its middle changed, and the old checksum."""
    at = len(payload) // 2
    changed = bytes(byte ^ BIT for byte in payload[at : at + 4])
    return payload[:at] + changed + payload[at + 4 :]
