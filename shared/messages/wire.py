"""Messages as bytes, and bytes as messages.

::

    offset  size    what
    0       4       b"RPW" and the version of this layout (1)
    4       4       uint32, length H of the header
    8       4       uint32, crc32 of every other byte
    12      H       header, MessagePack: {"schema", "v", "fields", "arrays"}
    ...     0..7    zeros, up to the next multiple of 8
    ...             the arrays, raw, each at the next multiple of 8

Everything is little-endian. ``schema`` is the name and hash of the registered type, ``v`` the
version of its meaning, ``fields`` a map of the fields that are not arrays, ``arrays`` a table
of ``[name, dtype, shape, offset]`` in the order of the bytes, offsets counted from the first
array. Dtype and shape are decided by the registered type: the table is compared with it, never
believed.

Old and new processes may meet: unknown fields and arrays are skipped, missing ones that have a
default take it.
"""

import functools
import struct
from collections.abc import Callable, Sequence
from typing import Annotated, Any, TypeVar, cast

import msgspec
import numpy as np
from zlib_ng import zlib_ng

from shared.errors import MessageError
from shared.messages.message import Array, Message
from shared.messages.schema import DTYPES, ArrayField, Schema, schema_of
from shared.messages.texts import clipped

M = TypeVar("M", bound=Message)

MAGIC = b"RPW\x01"
VERSION = 1
MAX_HEADER = 1 << 20
"""Longest header (bytes)."""
MAX_TEXT = 1 << 14
"""Longest text in a field (characters)."""
MAX_DIM = 1 << 28
"""Largest dimension of an array."""
MAX_ARRAYS = 64
MAX_NDIM = 8

_PREFIX = struct.Struct("<4sII")
_ALIGN = 8
_crc32: Callable[[Any, int], int] = cast("Any", zlib_ng).crc32
"""The crc32 of ``zlib``, by the processor's own instructions."""


class _Entry(msgspec.Struct, array_like=True, frozen=True):
    """One row of the array table."""

    name: str
    dtype: str
    shape: Annotated[tuple[Annotated[int, msgspec.Meta(ge=0, le=MAX_DIM)], ...],
                     msgspec.Meta(max_length=MAX_NDIM)]  # fmt: skip
    offset: int


class _Header(msgspec.Struct, frozen=True):
    schema: str
    v: int
    fields: msgspec.Raw
    arrays: Annotated[tuple[_Entry, ...], msgspec.Meta(max_length=MAX_ARRAYS)] = ()


def _plain(value: Any) -> object:
    """Turn a numpy scalar into Python's; anything else does not belong in a header."""
    if isinstance(value, np.generic):
        return cast("object", value.item())
    raise TypeError(f"{type(value).__name__} cannot be sent")


_encoder = msgspec.msgpack.Encoder(enc_hook=_plain)
_decode_header = msgspec.msgpack.Decoder(_Header).decode


def encode(message: Message) -> bytes:
    """Return the bytes of a message.

    Raises:
        ValueError: if an array has not its registered dtype and shape, or a field not its type's
            bounds: a bug of the caller.
    """
    schema = schema_of(type(message))
    arrays, table, size = _lay_out(schema, message)
    fields = {name: getattr(message, name) for name in schema.scalars}
    for name, value in fields.items():
        _check_text(schema, name, value, ValueError)
    try:
        header = _encoder.encode(
            {"schema": schema.name, "v": VERSION, "fields": fields, "arrays": table}
        )
    except (TypeError, OverflowError, RecursionError) as error:
        raise ValueError(f"{schema.message.__name__} cannot be encoded: {error}") from error
    if len(header) > MAX_HEADER:
        raise ValueError(
            f"{schema.message.__name__}: header of {len(header)} B is over {MAX_HEADER}"
        )
    parts: list[Any] = [header]
    at = 0
    if arrays:
        parts.append(bytes(-(_PREFIX.size + len(header)) % _ALIGN))
        for array, (_, _, _, offset) in zip(arrays, table, strict=True):
            if offset > at:
                parts.append(bytes(offset - at))
            if array.nbytes:
                parts.append(array.data.cast("B"))
            at = offset + array.nbytes
        assert at == size
    prefix = MAGIC + len(header).to_bytes(4, "little")
    crc = _crc32(prefix, 0)
    for part in parts:
        crc = _crc32(part, crc)
    return b"".join((prefix, crc.to_bytes(4, "little"), *parts))


def decode(message: type[M], payload: bytes | memoryview, max_bytes: int) -> M:
    """Return the message in ``payload``; its arrays are read-only views of ``payload``.

    Args:
        message: the registered type expected here.
        payload: everything that arrived.
        max_bytes: refuse longer payloads unread.

    Raises:
        MessageError: if the bytes are anything else than exactly one such message.
    """
    schema = schema_of(message)
    try:
        header, base = _read_header(schema, payload, max_bytes)
        arrays = _read_arrays(schema, header, payload, base)
        fields = _field_decoder(message).decode(header.fields)
        values = {name: getattr(fields, name) for name in schema.scalars}
        for name, value in values.items():
            _check_text(schema, name, value, MessageError)
        return message(**values, **arrays)
    except MessageError:
        raise
    except (ValueError, TypeError, OverflowError, RecursionError) as error:
        raise _refusal(schema, str(error) or type(error).__name__) from error


@functools.cache
def _field_decoder(message: type[Message]) -> msgspec.msgpack.Decoder[msgspec.Struct]:
    return msgspec.msgpack.Decoder(schema_of(message).fields)


def _lay_out(
    schema: Schema, message: Message
) -> tuple[list[Array], list[tuple[str, str, Sequence[int], int]], int]:
    """Return the arrays, their table and the bytes they take, checked against the schema."""
    arrays: list[Array] = []
    table: list[tuple[str, str, Sequence[int], int]] = []
    dims: dict[str, int] = {}
    end = 0
    for field in schema.arrays:
        array = cast("Array", getattr(message, field.name))
        if not isinstance(array, np.ndarray):  # pyright: ignore[reportUnnecessaryIsInstance]
            raise ValueError(
                f"{schema.message.__name__}.{field.name} is a {type(array).__name__}, "
                f"expected a {field.spec.dtype} array"
            )
        wrong = _mismatch(field, array.dtype.name, array.shape, dims)
        if wrong:
            raise ValueError(f"{schema.message.__name__}.{wrong}")
        if array.dtype != field.dtype or not array.flags.c_contiguous:
            array = np.ascontiguousarray(array, dtype=field.dtype)
        offset = end + -end % _ALIGN
        end = offset + array.nbytes
        arrays.append(array)
        table.append((field.name, field.spec.dtype, array.shape, offset))
    return arrays, table, end


def _read_header(
    schema: Schema, payload: bytes | memoryview, max_bytes: int
) -> tuple[_Header, int]:
    """Return the header and where the arrays begin; length, identity and checksum are right."""
    size = len(payload)
    if size > max_bytes:
        raise _refusal(schema, f"{size} B is over the limit of {max_bytes} B")
    if size < _PREFIX.size:
        raise _refusal(schema, f"{size} B is shorter than the prefix of {_PREFIX.size} B")
    magic, length, crc = _PREFIX.unpack_from(payload)
    if magic != MAGIC:
        raise _refusal(schema, f"starts with {magic!r}, expected {MAGIC!r}")
    end = _PREFIX.size + length
    if length > MAX_HEADER or end > size:
        raise _refusal(schema, f"claims a header of {length} B in a payload of {size} B")
    view = memoryview(payload)
    header = _decode_header(view[_PREFIX.size : end])
    base = end + -end % _ALIGN
    expected = base + _extent(schema, header) if header.arrays else end
    if size != expected:
        raise _refusal(schema, f"is {size} B long, its array table says {expected} B")
    actual = _crc32(view[_PREFIX.size :], _crc32(view[:8], 0))
    if actual != crc:
        raise _refusal(schema, f"has checksum {actual:08x}, expected {crc:08x}")
    if header.schema != schema.name:
        raise _refusal(
            schema,
            f"has schema {header.schema[:80]!r}, expected {schema.name!r}: "
            "run the same version of Riposte on both sides",
        )
    if header.v != VERSION:
        raise _refusal(schema, f"has version {header.v}, this process reads {VERSION}")
    return header, base


def _extent(schema: Schema, header: _Header) -> int:
    """Return the bytes from the first array to the end of the last, each at its only place."""
    end = 0
    for entry in header.arrays:
        if entry.dtype not in DTYPES:
            raise _refusal(schema, f"array {entry.name[:80]!r} has dtype {entry.dtype[:80]!r}")
        offset = end + -end % _ALIGN
        if entry.offset != offset:
            raise _refusal(
                schema, f"array {entry.name[:80]!r} is at {entry.offset}, expected {offset}"
            )
        count = 1
        for dim in entry.shape:
            count *= dim
        end = offset + count * np.dtype(entry.dtype).itemsize
    return end


def _read_arrays(
    schema: Schema, header: _Header, payload: bytes | memoryview, base: int
) -> dict[str, Array]:
    """Return the registered arrays by name, their values checked."""
    table = {entry.name: entry for entry in header.arrays}
    if len(table) != len(header.arrays):
        raise _refusal(schema, "has an array twice")
    arrays: dict[str, Array] = {}
    dims: dict[str, int] = {}
    for field in schema.arrays:
        entry = table.get(field.name)
        if entry is None:
            if field.default is None:
                raise _refusal(schema, f"lacks the array {field.name!r}")
            arrays[field.name] = field.default()
            continue
        wrong = _mismatch(field, entry.dtype, entry.shape, dims)
        if wrong:
            raise _refusal(schema, wrong)
        count = 1
        for dim in entry.shape:
            count *= dim
        array = np.frombuffer(payload, field.dtype, count, base + entry.offset) if count else (
            np.empty(0, field.dtype)
        )  # fmt: skip
        wrong = _bad_value(field, array)
        if wrong:
            raise _refusal(schema, wrong)
        array = array.reshape(entry.shape)
        array.flags.writeable = False
        arrays[field.name] = array
    return arrays


def _mismatch(
    field: ArrayField, dtype: str, shape: tuple[int, ...], dims: dict[str, int]
) -> str | None:
    """Return how dtype or shape differ from the registered ones; named dimensions go to dims."""
    spec = field.spec
    if dtype != spec.dtype:
        return f"{field.name} has dtype {dtype}, expected {spec.dtype}"
    if len(shape) == len(spec.shape):
        for have, want in zip(shape, spec.shape, strict=True):
            if have != (want if isinstance(want, int) else dims.setdefault(want, have)):
                break
        else:
            return None
    named = "".join(f", {name} = {size}" for name, size in dims.items())
    want = "[" + ", ".join(map(str, spec.shape)) + "]"
    return f"{field.name} has shape {list(shape)}, expected {want}{named}"


def _bad_value(field: ArrayField, array: Array) -> str | None:
    """Return which values of a flat array are impossible, if any."""
    if array.dtype.kind == "b":
        if array.size and int(array.view(np.uint8).max()) > 1:
            return f"{field.name} has a byte that is neither 0 nor 1"
    elif array.dtype.kind == "f" and field.spec.finite:
        finite = np.isfinite(array)
        if not finite.all():
            at = int(finite.argmin())
            return f"{field.name} is not finite ({array[at]} at flat index {at})"
    return None


def _check_text(schema: Schema, name: str, value: Any, error: type[ValueError]) -> None:
    """Refuse a text that is too long, however deep it sits in a field."""
    if isinstance(value, str):
        if len(value) > MAX_TEXT:
            raise error(
                f"{schema.message.__name__}.{name} has a text of {len(value)} characters, "
                f"at most {MAX_TEXT} are allowed"
            )
    elif isinstance(value, dict):
        for key, item in cast("dict[Any, Any]", value).items():
            _check_text(schema, name, key, error)
            _check_text(schema, name, item, error)
    elif isinstance(value, tuple | list):
        for item in cast("Sequence[Any]", value):
            _check_text(schema, name, item, error)
    elif isinstance(value, msgspec.Struct):
        for field in value.__struct_fields__:
            _check_text(schema, name, getattr(value, field), error)


def _refusal(schema: Schema, why: str) -> MessageError:
    return MessageError(f"{schema.message.__name__} refused: {clipped(why)}")
