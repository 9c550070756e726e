"""Rollouts that are not what they say: what an actor may send that is broken or means harm."""

import struct
import zlib
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np

from shared.messages.message import Array
from shared.messages.training import Rollout

FORGED = 1 << 40
"""Added to the sequence number of what is made up, so that its name says so."""
STEPS = 10_000
"""Of a rollout that is over the limit of 8 MiB with 8 bouts."""

POLICY_LIE = "corrupt policy"
"""What goes to the actors, who do not answer."""

Lie = Callable[[Rollout], Rollout]


def forged(rollout: Rollout, **fields: Any) -> Rollout:
    """Return a rollout under a name of its own, with other fields."""
    return msgspec.structs.replace(rollout, sequence=rollout.sequence + FORGED, **fields)


def _spoiled(array: Array, value: float) -> Array:
    copy = array.copy()
    copy.flat[copy.size // 2] = value
    return copy


def _huge(rollout: Rollout) -> Rollout:
    def long(array: Array) -> Array:
        return np.resize(array, (STEPS, *array.shape[1:]))

    names = ("obs", "actions", "means", "log_probs", "rewards")
    return forged(rollout, **{name: long(getattr(rollout, name)) for name in names})


LIES: dict[str, Lie] = {
    "not a number": lambda it: forged(it, rewards=_spoiled(it.rewards, np.nan)),
    "infinite": lambda it: forged(it, obs=_spoiled(it.obs, np.inf)),
    "beyond all bounds": lambda it: forged(it, rewards=_spoiled(it.rewards, 1e30)),
    "wrong opponent": lambda it: forged(it, opponent="scripted:heuristic"),
    "somebody else's lease": lambda it: forged(it, actor="actor-0"),
    "finished stage": lambda it: forged(it, stage=it.stage - 1),
    "other simulator": lambda it: forged(it, model="0" * 64),
    "stale version": lambda it: forged(it, policy_version=max(it.policy_version - 50, 0)),
    "replayed": lambda it: forged(it),
    "other probabilities": lambda it: forged(it, log_probs=it.log_probs + 1.0),
    "bout out of time": lambda it: forged(it, first_step=it.first_step + 100_000),
    "wrong shape": lambda it: forged(it),
    "damaged bytes": lambda it: forged(it),
    "huge": _huge,
    "sent again": lambda it: it,
}
"""By name. The last one is the truth, told twice: it must count once."""
FORGERIES: dict[str, Callable[[bytes], bytes]] = {
    "wrong shape": lambda payload: with_other_shape(payload),
    "damaged bytes": lambda payload: payload[:-4] + bytes(4 * [payload[-4] ^ 0x55]),
}
"""What is changed in the bytes of a lie, where no message can say it."""


def with_other_shape(payload: bytes) -> bytes:
    """Return the bytes with an array table that says 9 where it said 27, and a right checksum.

    Raises:
        ValueError: the header does not keep its length; use a rollout of fewer steps.
    """
    size = struct.unpack_from("<I", payload, 4)[0]
    header = msgspec.msgpack.decode(payload[12 : 12 + size])
    for entry in header["arrays"]:
        if entry[0] == "obs":
            steps, worlds, width = entry[2]
            entry[2] = [3 * steps, worlds, width // 3]
    changed = msgspec.msgpack.encode(header)
    if len(changed) != size:
        raise ValueError(f"the header has {len(changed)} B, expected {size} B")
    rest = changed + payload[12 + size :]
    return payload[:8] + zlib.crc32(rest, zlib.crc32(payload[:8])).to_bytes(4, "little") + rest
