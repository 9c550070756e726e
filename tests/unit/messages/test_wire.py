"""The wire format: its bytes, and what it refuses."""

import struct
import time
import zlib
from typing import Annotated, Any

import msgpack
import msgspec
import numpy as np
import pytest

from shared.errors import MessageError
from shared.messages.league import Incident, Lease, SnapshotReply, Stage
from shared.messages.message import Array, ArraySpec, Message
from shared.messages.schema import hash_of, schema_of
from shared.messages.training import ACTION_DIM, OBS_DIM, Receipt, Rollout
from shared.messages.wire import MAX_TEXT, decode, encode

LIMIT = 8 << 20
T, N = 4, 3


def a_rollout(**changes: Any) -> Rollout:
    rng = np.random.default_rng(0)

    def noise(*shape: int) -> Array:
        return rng.standard_normal(shape).astype(np.float32)

    fields: dict[str, Any] = {
        "agent": "antagonist", "actor": "actor-0", "boot": "b0", "sequence": 7, "lease": "l1",
        "stage": 2, "policy_version": 5, "snapshot": "ab" * 32, "opponent": "scripted:static",
        "model": "m", "seed": 2**63, "bouts": np.arange(N), "obs": noise(T, N, OBS_DIM),
        "first_step": np.zeros(N, np.int32), "last_obs": noise(N, OBS_DIM),
        "actions": noise(T, N, ACTION_DIM), "means": noise(T, N, ACTION_DIM),
        "stds": noise(ACTION_DIM), "log_probs": noise(T, N), "rewards": noise(T, N),
        "truncated": np.array([True, False, True]),
    }  # fmt: skip
    return Rollout(**(fields | changes))


def a_stage(**changes: Any) -> dict[str, Any]:
    fields = {
        "index": 0, "phase": "one", "iteration": 1, "agent": "protagonist", "opponent": "x",
        "max_updates": 3, "score_weight": 1.0, "shaping_weight": 0.5,
    }  # fmt: skip
    return fields | changes


def packed(
    header: Any, arrays: bytes = b"", *, magic: bytes = b"RPW\x01", crc: int | None = None
) -> bytes:
    """Return a payload written without the code under test."""
    text = header if isinstance(header, bytes) else msgpack.packb(header)
    body = text + (bytes(-(12 + len(text)) % 8) + arrays if arrays else b"")
    prefix = magic + struct.pack("<I", len(text))
    crc = zlib.crc32(body, zlib.crc32(prefix)) if crc is None else crc
    return prefix + struct.pack("<I", crc) + body


def header_of(kind: type[Message], fields: dict[str, Any], arrays: Any = ()) -> dict[str, Any]:
    return {"schema": schema_of(kind).name, "v": 1, "fields": fields, "arrays": list(arrays)}


def test_an_independent_msgpack_reader_understands_a_rollout() -> None:
    message = a_rollout()
    payload = encode(message)
    magic, length, crc = struct.unpack_from("<4sII", payload)
    assert magic == b"RPW\x01"
    assert crc == zlib.crc32(payload[:8] + payload[12:])
    header = msgpack.unpackb(payload[12 : 12 + length])
    name, digest = header["schema"].split("/")
    assert (name, len(digest)) == ("Rollout", 16)
    assert header["v"] == 1
    assert header["fields"]["policy_version"] == 5
    assert header["fields"]["seed"] == 2**63
    base = -(-(12 + length) // 8) * 8
    seen = 0
    for name, dtype, shape, offset in header["arrays"]:
        assert offset % 8 == 0
        array = np.frombuffer(payload, "<" + np.dtype(dtype).str[1:], np.prod(shape, dtype=int),
                              base + offset).reshape(shape)  # fmt: skip
        np.testing.assert_array_equal(array, getattr(message, name))
        seen += 1
    assert seen == 10


def test_a_message_written_by_an_independent_msgpack_writer_is_read() -> None:
    frame = np.arange(5, dtype=np.uint8).tobytes()
    payload = packed(
        header_of(SnapshotReply, {"found": True}, [["payload", "uint8", [5], 0]]), frame
    )
    message = decode(SnapshotReply, payload, LIMIT)
    assert message.found
    assert message.payload.tobytes() == frame
    assert message.reason == ""


def test_arrays_are_views_of_the_payload_that_nobody_can_write() -> None:
    payload = encode(a_rollout())
    message = decode(Rollout, payload, LIMIT)
    assert np.shares_memory(message.obs, np.frombuffer(payload, np.uint8))
    with pytest.raises(ValueError, match="read-only"):
        message.obs[0, 0, 0] = 1.0
    writable = decode(Rollout, memoryview(bytearray(payload)), LIMIT)
    assert not writable.obs.flags.writeable


def test_unknown_fields_and_arrays_of_a_newer_sender_are_skipped() -> None:
    header = header_of(
        SnapshotReply,
        {"found": True, "age": 3, "notes": {"a": [1, 2]}},
        [["payload", "uint8", [3], 0], ["extra", "float32", [2], 8]],
    )
    header["compressed"] = False
    message = decode(SnapshotReply, packed(header, b"abc" + bytes(13)), LIMIT)
    assert message.payload.tobytes() == b"abc"


def test_fields_that_an_older_sender_does_not_know_take_their_default() -> None:
    class Reading(Message, frozen=True, kw_only=True):
        at: float
        unit: str = "m"
        tags: dict[str, int] = msgspec.field(default_factory=dict)
        trace: Annotated[Array, ArraySpec("float32", ("K",))] = msgspec.field(
            default_factory=lambda: np.zeros(0, np.float32)
        )

    older = msgspec.defstruct("Reading", [("at", float)], bases=(Message,), frozen=True)
    new = decode(Reading, encode(older(at=1.5)), LIMIT)
    assert (new.at, new.unit, new.tags, new.trace.size) == (1.5, "m", {}, 0)
    assert decode(older, encode(Reading(at=2.5, unit="mm")), LIMIT) == older(at=2.5)


def test_a_renamed_or_retyped_field_changes_the_schema_hash() -> None:
    class Reading(Message, frozen=True, kw_only=True):
        at: float

    renamed = msgspec.defstruct("Reading", [("when", float)], bases=(Message,))
    retyped = msgspec.defstruct("Reading", [("at", int)], bases=(Message,))
    assert len({hash_of(Reading), hash_of(renamed), hash_of(retyped)}) == 3


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"obs": np.zeros((T, N, 26), np.float32)}, r"obs has shape \[4, 3, 26\]"),
        ({"obs": np.zeros((T, N, OBS_DIM))}, "obs has dtype float64, expected float32"),
        ({"rewards": np.zeros((T + 1, N), np.float32)}, r"rewards has shape .* T = 4"),
        ({"bouts": [1, 2, 3]}, "bouts is a list, expected a int64 array"),
        ({"sequence": 2**64}, "cannot be encoded"),
        ({"actor": "a" * (MAX_TEXT + 1)}, "actor has a text of"),
        ({"actor": object()}, "object cannot be sent"),
    ],
)
def test_a_message_that_is_not_its_own_schema_is_not_sent(
    change: dict[str, Any], what: str
) -> None:
    with pytest.raises(ValueError, match=what):
        encode(a_rollout(**change))


def test_numpy_scalars_are_sent_as_numbers() -> None:
    message = a_rollout(sequence=np.int64(9), policy_version=np.int32(2))
    assert decode(Rollout, encode(message), LIMIT).sequence == 9


def test_arrays_of_any_memory_layout_are_sent_in_order() -> None:
    obs = np.asfortranarray(np.random.default_rng(1).random((T, N, OBS_DIM), np.float32))
    swapped = obs.astype(">f4")
    for sent in (obs, swapped, np.repeat(obs, 2, axis=0)[::2]):
        np.testing.assert_array_equal(decode(Rollout, encode(a_rollout(obs=sent)), LIMIT).obs, obs)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("field", ["obs", "last_obs", "rewards", "stds"])
def test_a_value_that_is_not_finite_is_refused_by_name(field: str, value: float) -> None:
    message = a_rollout()
    array = getattr(message, field).copy()
    array[(-1,) * array.ndim] = value
    with pytest.raises(MessageError, match=f"{field} is not finite"):
        decode(Rollout, encode(a_rollout(**{field: array})), LIMIT)


def test_a_bool_that_is_neither_0_nor_1_is_refused() -> None:
    truncated = np.array([0, 2, 1], np.uint8).view(bool)
    with pytest.raises(MessageError, match="truncated has a byte that is neither 0 nor 1"):
        decode(Rollout, encode(a_rollout(truncated=truncated)), LIMIT)


def test_a_payload_over_the_limit_is_refused_unread() -> None:
    with pytest.raises(MessageError, match="is over the limit of 100 B"):
        decode(Rollout, bytes(101), 100)


def test_another_message_is_refused_with_both_names() -> None:
    with pytest.raises(MessageError, match=r"has schema 'Receipt/.*expected 'Rollout/"):
        decode(Rollout, encode(Receipt(accepted=True)), LIMIT)


@pytest.mark.parametrize(
    ("payload", "what"),
    [
        (b"", "shorter than the prefix"),
        (packed({}, magic=b"RPW\x02"), "starts with"),
        (packed({}), "schema"),
        (packed(header_of(Receipt, {})), "accepted"),
        (packed(header_of(Receipt, {"accepted": 1})), "Expected `bool`"),
        (packed(header_of(Receipt, {"accepted": True}) | {"v": 2}), "has version 2"),
        (packed(header_of(Receipt, {"accepted": True}), crc=1), "has checksum"),
        (packed(header_of(Receipt, {"accepted": True, "reason": "x" * 20000})), "has a text of"),
        (b"RPW\x01" + struct.pack("<II", 2**32 - 1, 0), "claims a header of 4294967295 B"),
        (packed(header_of(Receipt, {"accepted": True}, [["a", "object", [], 0]])), "has dtype"),
        (packed(header_of(Receipt, {"accepted": True}, [["a", "bool", [2**40], 0]])), "arrays"),
        (packed(header_of(Receipt, {"accepted": True}, [["a", "bool", [-1], 0]])), "arrays"),
        (packed(header_of(Receipt, {"accepted": True}, [["a", "bool", [2**28] * 8, 0]])), "long"),
        (packed(header_of(Receipt, {"accepted": True}, [["a", "bool", [1], 8]]), b"1"), "is at 8"),
        (packed(header_of(SnapshotReply, {"found": True})), "lacks the array 'payload'"),
        (
            packed(
                header_of(SnapshotReply, {"found": True}, [["payload", "uint8", [1], 0]] * 2),
                b"12",
            ),
            "expected 8",
        ),
    ],
)
def test_what_is_not_a_message_is_refused_with_the_reason(payload: bytes, what: str) -> None:
    kind = SnapshotReply if b"SnapshotReply" in payload else Receipt
    with pytest.raises(MessageError, match=what):
        decode(kind, payload, LIMIT)


def test_hostile_headers_are_refused_in_little_time() -> None:
    nested = b"\x91" * 500_000 + b"\x90"
    maps = b"\xdd" + struct.pack(">I", 900_000) + b"\x80" * 900_000
    for field in (nested, maps):
        text = b"\x84\xa6schema\xa1x\xa1v\x01\xa6fields\x80\xa1z" + field
        begin = time.perf_counter()
        with pytest.raises(MessageError):
            decode(Receipt, packed(text), LIMIT)
        assert time.perf_counter() - begin < 1.0


def test_nested_messages_and_none_come_back_as_themselves() -> None:
    lease = Lease(lease="l", kind="train", stage=Stage(**a_stage()))
    assert decode(Lease, encode(lease), LIMIT) == lease
    assert decode(Lease, encode(Lease(lease="", kind="none")), LIMIT).stage is None


def test_a_wrong_literal_is_refused() -> None:
    with pytest.raises(MessageError, match="Invalid enum value 'play'"):
        decode(Lease, packed(header_of(Lease, {"lease": "l", "kind": "play"})), LIMIT)


def test_a_text_is_bounded_however_deep_it_sits() -> None:
    lease = Lease(lease="l", kind="train", stage=Stage(**a_stage(opponent="x" * 20_000)))
    with pytest.raises(ValueError, match=r"Lease\.stage has a text of 20000 characters"):
        encode(lease)


def test_an_array_without_a_spec_cannot_be_registered() -> None:
    class Loose(Message, frozen=True, kw_only=True):
        data: Array

    class Outer(Message, frozen=True, kw_only=True):
        inner: SnapshotReply

    class Odd(Message, frozen=True, kw_only=True):
        data: Annotated[Array, ArraySpec("complex64", ("K",))]

    for kind, what in ((Loose, "ArraySpec"), (Outer, "ArraySpec"), (Odd, "complex64")):
        with pytest.raises(ValueError, match=what):
            schema_of(kind)


def test_an_incident_of_the_largest_allowed_text_fits_the_wire() -> None:
    incident = Incident(source="a", boot="b", sequence=0, kind="k", detail="x" * MAX_TEXT, at_ns=1)
    assert decode(Incident, encode(incident), LIMIT) == incident
