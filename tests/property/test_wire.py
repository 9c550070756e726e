"""The codec against every registered message, and against everything that is not one."""

import math
import struct
import types
import zlib
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import msgpack
import msgspec
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.bus.base import NoAnswer, Refused
from shared.errors import MessageError
from shared.messages.message import ArraySpec, Message
from shared.messages.schema import schema_of
from shared.messages.topics import SERVICES, TOPICS
from shared.messages.wire import decode, encode

LIMIT = 1 << 24
TYPES: list[type[Message]] = sorted(
    {topic.message for topic in TOPICS}
    | {service.request for service in SERVICES}
    | {service.reply for service in SERVICES}
    | {Refused, NoAnswer},
    key=lambda kind: kind.__name__,
)
every_type = pytest.mark.parametrize("kind", TYPES, ids=lambda kind: kind.__name__)


def values(annotation: Any) -> st.SearchStrategy[Any]:
    """Return a strategy for a header field."""
    if annotation is int:
        return st.integers(-(2**63), 2**64 - 1)
    if annotation is float:
        return st.floats(allow_nan=False)
    if annotation is str:
        return st.text(max_size=12)
    if annotation is bool:
        return st.booleans()
    if annotation is type(None):
        return st.none()
    if isinstance(annotation, type) and issubclass(annotation, msgspec.Struct):
        fields = {f.name: values(f.type) for f in msgspec.structs.fields(annotation)}
        return st.builds(annotation, **fields)
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return st.sampled_from(args)
    if origin in (Union, types.UnionType):
        return st.one_of([values(arg) for arg in args])
    if origin is tuple and args[-1] is ...:
        return st.lists(values(args[0]), max_size=3).map(tuple)
    if origin is dict:
        return st.dictionaries(values(args[0]), values(args[1]), max_size=3)
    raise AssertionError(f"no strategy for {annotation}: add one")


@st.composite
def messages(draw: st.DrawFn, kind: type[Message]) -> Message:
    """Return any message of a registered type."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    dims: dict[str, int] = {}
    fields: dict[str, Any] = {}
    for field in msgspec.structs.fields(kind):
        if get_origin(field.type) is not Annotated:
            fields[field.name] = draw(values(field.type))
            continue
        (spec,) = (a for a in get_args(field.type) if isinstance(a, ArraySpec))
        for dim in spec.shape:
            if isinstance(dim, str) and dim not in dims:
                dims[dim] = draw(st.integers(0, 4))
        shape = tuple(dims[d] if isinstance(d, str) else d for d in spec.shape)
        size = math.prod(shape)
        dtype = np.dtype(spec.dtype)
        if dtype.kind == "f":
            flat = rng.standard_normal(size).astype(dtype)
        elif dtype.kind == "b":
            flat = rng.integers(0, 2, size).astype(dtype)
        else:
            flat = np.frombuffer(rng.bytes(size * dtype.itemsize), dtype)
        fields[field.name] = flat.reshape(shape)
    return kind(**fields)


def same(left: Any, right: Any) -> bool:
    """Return whether two messages are equal, arrays bit for bit."""
    for name in left.__struct_fields__:
        a, b = getattr(left, name), getattr(right, name)
        if isinstance(a, np.ndarray):
            if a.dtype != b.dtype or a.shape != b.shape or a.tobytes() != b.tobytes():
                return False
        elif a != b:
            return False
    return True


@every_type
@given(data=st.data())
@settings(max_examples=40, deadline=None)
def test_every_message_comes_back_as_it_was(kind: type[Message], data: st.DataObject) -> None:
    message = data.draw(messages(kind))
    back = decode(kind, encode(message), LIMIT)
    assert same(message, back)
    for field in schema_of(kind).arrays:
        array = getattr(back, field.name)
        assert not array.flags.writeable
        assert array.flags.aligned


@every_type
@given(data=st.data())
@settings(max_examples=20, deadline=None)
def test_any_flipped_bit_is_refused(kind: type[Message], data: st.DataObject) -> None:
    payload = bytearray(encode(data.draw(messages(kind))))
    for bit in data.draw(st.lists(st.integers(0, 8 * len(payload) - 1), min_size=1, max_size=40)):
        payload[bit // 8] ^= 1 << bit % 8
        with pytest.raises(MessageError):
            decode(kind, bytes(payload), LIMIT)
        payload[bit // 8] ^= 1 << bit % 8


@every_type
@given(data=st.data())
@settings(max_examples=20, deadline=None)
def test_any_truncation_or_addition_is_refused(kind: type[Message], data: st.DataObject) -> None:
    payload = encode(data.draw(messages(kind)))
    for cut in data.draw(st.lists(st.integers(0, len(payload) - 1), min_size=1, max_size=20)):
        with pytest.raises(MessageError):
            decode(kind, payload[:cut], LIMIT)
    with pytest.raises(MessageError):
        decode(kind, payload + data.draw(st.binary(min_size=1, max_size=20)), LIMIT)


@given(junk=st.binary(max_size=300), kind=st.sampled_from(TYPES))
@settings(max_examples=300, deadline=None)
def test_junk_is_refused(junk: bytes, kind: type[Message]) -> None:
    for payload in (junk, b"RPW\x01" + junk, sealed(junk)):
        with pytest.raises(MessageError):
            decode(kind, payload, LIMIT)


@given(data=st.data(), kind=st.sampled_from(TYPES))
@settings(max_examples=300, deadline=None)
def test_a_header_of_anything_is_refused_or_read_but_never_crashes(
    data: st.DataObject, kind: type[Message]
) -> None:
    """The checksum is right, so only the checks behind it can help."""
    payload = encode(data.draw(messages(kind)))
    header = parsed(payload)
    anything = st.recursive(
        st.none() | st.booleans() | st.integers(-(2**63), 2**64 - 1) | st.floats() | st.text()
        | st.binary(),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
        max_leaves=6,
    )  # fmt: skip
    target = data.draw(st.sampled_from([header, header["fields"]]))
    if data.draw(st.booleans()) or not header["arrays"]:
        key = data.draw(st.sampled_from(sorted(target)) if target else st.just("extra"))
        target[key] = data.draw(anything)
    else:
        row = data.draw(st.sampled_from(header["arrays"]))
        row[data.draw(st.integers(0, 3))] = data.draw(anything)
    try:
        message = decode(kind, rebuilt(payload, header), LIMIT)
    except MessageError:
        return
    assert isinstance(message, kind)


@given(
    shape=st.lists(st.integers(-(2**63), 2**64 - 1), max_size=9),
    offset=st.integers(-(2**63), 2**64 - 1),
)
@settings(max_examples=200, deadline=None)
def test_hostile_lengths_are_refused(shape: list[int], offset: int) -> None:
    kind = TYPES[[t.__name__ for t in TYPES].index("PolicyAnnouncement")]
    fields = {"agent": "antagonist", "policy_version": 1, "stage": 0, "snapshot": ""}
    message = kind(**fields, payload=np.zeros(16, np.uint8))
    payload = encode(message)
    header = parsed(payload)
    header["arrays"] = [["payload", "uint8", shape, offset]]
    if (shape, offset) != ([16], 0):
        with pytest.raises(MessageError):
            decode(kind, rebuilt(payload, header), LIMIT)


def parsed(payload: bytes) -> dict[str, Any]:
    """Return the header, read without the code under test."""
    length = struct.unpack_from("<I", payload, 4)[0]
    return msgpack.unpackb(payload[12 : 12 + length])


def rebuilt(payload: bytes, header: dict[str, Any]) -> bytes:
    """Return a payload with another header and a right checksum, made without our encoder."""
    length = struct.unpack_from("<I", payload, 4)[0]
    base = -(-(12 + length) // 8) * 8
    packed = msgpack.packb(header)
    pad = bytes(-(12 + len(packed)) % 8) if header.get("arrays") else b""
    body = packed + pad + payload[base:]
    prefix = b"RPW\x01" + struct.pack("<I", len(packed))
    return prefix + struct.pack("<I", zlib.crc32(body, zlib.crc32(prefix))) + body


def sealed(body: bytes) -> bytes:
    """Return junk as a header, with a right length and checksum."""
    prefix = b"RPW\x01" + struct.pack("<I", len(body))
    return prefix + struct.pack("<I", zlib.crc32(body, zlib.crc32(prefix))) + body
