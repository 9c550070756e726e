"""What a registered message type means on the wire: its typed fields, its arrays and its hash."""

import dataclasses
import functools
import hashlib
import types
from collections.abc import Callable
from typing import Annotated, Any, Literal, Union, cast, get_args, get_origin

import msgspec
import numpy as np

from shared.messages.message import Array, ArraySpec, Message

DTYPES = frozenset({
    "bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64",
    "float32", "float64",
})  # fmt: skip
"""Every dtype an array on the wire can have; always little-endian there."""


@dataclasses.dataclass(frozen=True)
class ArrayField:
    """An array of a message type, as registered."""

    name: str
    spec: ArraySpec
    dtype: np.dtype[Any]
    default: Callable[[], Array] | None
    """Makes the value when the sender does not know the field; None when it is required."""


@dataclasses.dataclass(frozen=True)
class Schema:
    """A message type split into what goes into the header and what goes behind it."""

    message: type[Message]
    name: str
    """``Rollout/4f1c0a9be2d37a55``: the type's name and the hash of its required fields."""
    scalars: tuple[str, ...]
    """Names of the fields in the header."""
    fields: type[msgspec.Struct]
    """A struct of exactly those fields, into which the header is decoded and checked."""
    arrays: tuple[ArrayField, ...]


@functools.cache
def schema_of(message: type[Message]) -> Schema:
    """Return the schema of a message type.

    Fields with a default are left out of its hash: adding one keeps old and new processes on
    speaking terms, while renaming or retyping a required field does not.

    Raises:
        ValueError: if an array field has no ArraySpec, an unknown dtype, or sits in a nested
            message.
    """
    scalars: list[tuple[str, Any, Any]] = []
    arrays: list[ArrayField] = []
    for field in msgspec.structs.fields(message):
        spec = _spec_of(field.type)
        if spec is None:
            if _holds_arrays(field.type):
                raise ValueError(
                    f"{message.__name__}.{field.name}: an array needs "
                    "Annotated[Array, ArraySpec(...)] and a place at the top of its message"
                )
            scalars.append((field.name, field.type, _default_of(field)))
            continue
        if spec.dtype not in DTYPES:
            raise ValueError(
                f"{message.__name__}.{field.name}: dtype {spec.dtype} is none of {sorted(DTYPES)}"
            )
        dtype = np.dtype(spec.dtype).newbyteorder("<")
        arrays.append(ArrayField(field.name, spec, dtype, _default_array(field)))
    fields = msgspec.defstruct(f"{message.__name__}Fields", scalars, frozen=True, kw_only=True)
    return Schema(
        message=message,
        name=f"{message.__name__}/{hash_of(message)}",
        scalars=tuple(name for name, _, _ in scalars),
        fields=fields,
        arrays=tuple(arrays),
    )


def hash_of(message: type[msgspec.Struct]) -> str:
    """Return 16 hex digits over the required fields of a type, nested ones included."""
    return hashlib.sha256(_describe(message).encode()).hexdigest()[:16]


def _describe(annotation: Any) -> str:
    """Return one canonical text for a type, the same in every process and Python version."""
    if isinstance(annotation, type) and issubclass(annotation, msgspec.Struct):
        required = (field for field in msgspec.structs.fields(annotation) if field.required)
        inside = ",".join(f"{field.name}:{_describe(field.type)}" for field in required)
        return f"{annotation.__name__}{{{inside}}}"
    spec = _spec_of(annotation)
    if spec is not None:
        return f"array({spec.dtype},{list(spec.shape)})"
    origin = get_origin(annotation)
    if origin is Annotated:
        return _describe(get_args(annotation)[0])
    if origin is Literal:
        return "literal" + repr(sorted(map(repr, get_args(annotation))))
    if origin in (Union, types.UnionType):
        return "|".join(sorted(_describe(part) for part in get_args(annotation)))
    if origin is not None:
        parts = ",".join("..." if p is ... else _describe(p) for p in get_args(annotation))
        return f"{origin.__name__}[{parts}]"
    return "none" if annotation is type(None) else str(annotation.__name__)


def _spec_of(annotation: Any) -> ArraySpec | None:
    if get_origin(annotation) is not Annotated:
        return None
    return next((a for a in get_args(annotation)[1:] if isinstance(a, ArraySpec)), None)


def _holds_arrays(annotation: Any) -> bool:
    if isinstance(annotation, type) and issubclass(annotation, msgspec.Struct):
        return any(_holds_arrays(field.type) for field in msgspec.structs.fields(annotation))
    if annotation is np.ndarray or get_origin(annotation) is np.ndarray:
        return True
    return any(_holds_arrays(part) for part in get_args(annotation) if part is not ...)


def _default_of(field: msgspec.structs.FieldInfo) -> Any:
    if field.default_factory is not msgspec.NODEFAULT:
        return msgspec.field(default_factory=cast("Callable[[], Any]", field.default_factory))
    return field.default


def _default_array(field: msgspec.structs.FieldInfo) -> Callable[[], Array] | None:
    if field.required:
        return None
    if field.default_factory is not msgspec.NODEFAULT:
        return cast("Callable[[], Array]", field.default_factory)
    raise ValueError(f"{field.name}: give an array field a default_factory, not a default")
