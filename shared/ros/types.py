"""Messages: made, written, read and identified. With ``bags`` the only door to ``rosbags``.

A message is an instance of a plain class with the fields of its ROS definition; arrays of numbers
are NumPy arrays, other arrays lists. Types are named as in ROS 1: ``geometry_msgs/PoseStamped``;
the halves of a service are ``std_srvs/TriggerRequest`` and ``std_srvs/TriggerResponse``.
"""

import hashlib
import struct
from functools import cache
from typing import Any, Final, cast

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys import get_types_from_msg as parsed
from rosbags.typesys.store import Typestore

from shared.errors import MessageError
from shared.ros.definitions import MESSAGES, SERVICES

LONGEST_ARRAY: Final = 1 << 20
"""Elements of one array in a message; a longer one is refused before it is allocated."""
_TIMES: Final = {
    "builtin_interfaces/msg/Time": "time",
    "builtin_interfaces/msg/Duration": "duration",
}
_EMPTY: Final = "structure_needs_at_least_one_member"


@cache
def _store() -> Typestore:
    """Return all types there are; 0.1 s the first time."""
    store = get_typestore(Stores.ROS1_NOETIC)
    store.max_sequence_length = LONGEST_ARRAY
    for name, text in MESSAGES.items():
        store.register(parsed(text, _long(name)))
    for name, service in SERVICES.items():
        store.register(parsed(service.request, _long(f"{name}Request")))
        store.register(parsed(service.response, _long(f"{name}Response")))
    return store


def new(type_name: str, **fields: Any) -> Any:
    """Return a message; fields that are not given are zero or empty.

    Args:
        type_name: as ROS 1 names it.
        fields: values by name, messages for fields that are messages.

    Raises:
        ValueError: there is no such type or field.
    """
    known = dict(_fields(type_name))
    if unknown := fields.keys() - known.keys():
        raise ValueError(f"{type_name} has no field {sorted(unknown)[0]!r}")
    values = {
        name: fields[name] if name in fields else _zero(kind)
        for name, kind in known.items()
        if name != _EMPTY
    }
    return _store().types[_long(type_name)](**values)


def write(message: Any) -> bytes:
    """Return a message's bytes.

    Raises:
        ValueError: a field has a value of another type, or out of its range.
    """
    try:
        return bytes(_store().serialize_ros1(message, message.__msgtype__))
    except (
        SerdeError, struct.error, AttributeError, TypeError, AssertionError, OverflowError,
    ) as error:  # fmt: skip
        raise ValueError(f"no valid {message.__msgtype__}: {error}") from error


def read(type_name: str, data: bytes) -> Any:
    """Return the message that the bytes are.

    Raises:
        MessageError: they are none of this type.
    """
    try:
        return _store().deserialize_ros1(data, _long(type_name))
    except (SerdeError, IndexError, MemoryError, OverflowError, TypeError) as error:
        raise MessageError(f"{len(data)} bytes are no {type_name}: {error}") from error


def md5_of(type_name: str) -> str:
    """Return the sum by which two nodes agree on a message type.

    Raises:
        ValueError: there is no such type.
    """
    return hashlib.md5(_hashed(_long(type_name)).encode()).hexdigest()


def service_md5_of(service_type: str) -> str:
    """Return the sum by which two nodes agree on a service.

    Raises:
        ValueError: there is no such service.
    """
    halves = (_hashed(_long(f"{service_type}{half}")) for half in ("Request", "Response"))
    return hashlib.md5("".join(halves).encode()).hexdigest()


@cache
def definition_of(type_name: str) -> str:
    """Return the full text of a message's definition, as a publisher sends it."""
    return _store().generate_msgdef(_long(type_name))[0]


def seconds_of(stamp: Any) -> float:
    """Return a message's time or duration in seconds."""
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def stamp_of(wall_ns: int) -> Any:
    """Return nanoseconds since 1970 as a message's time."""
    return _store().types["builtin_interfaces/msg/Time"](
        sec=wall_ns // 1_000_000_000, nanosec=wall_ns % 1_000_000_000
    )


def _long(type_name: str) -> str:
    package, _, name = type_name.partition("/")
    return f"{package}/msg/{name}"


def _fields(type_name: str) -> list[tuple[str, Any]]:
    """Return names and kinds of a type's fields."""
    long = _long(type_name)
    if long not in _store().fielddefs:
        raise ValueError(f"{type_name} is no message type that is known here")
    return cast("list[tuple[str, Any]]", _store().fielddefs[long][1])


def _zero(kind: Any) -> Any:
    node, what = kind
    if node == Nodetype.BASE:
        name = what[0]
        return (
            "" if name == "string" else False if name == "bool" else np.dtype(name).type(0).item()
        )
    if node == Nodetype.NAME:
        package, _, name = what.split("/")
        return new(f"{package}/{name}")
    inner, count = what
    length = count if node == Nodetype.ARRAY else 0
    if inner[0] == Nodetype.BASE and inner[1][0] != "string":
        return np.zeros(length, inner[1][0])
    return [_zero(inner) for _ in range(length)]


@cache
def _hashed(long: str) -> str:
    """Return the text that a sum is made of: constants, then fields, inner types by their sums."""
    if long not in _store().fielddefs:
        raise ValueError(f"{long.replace('/msg/', '/')} is no type that is known here")
    constants, fields = cast("tuple[list[Any], list[Any]]", _store().fielddefs[long])
    lines = [f"{kind} {name}={value}" for name, kind, value in constants]
    lines += [f"{_hashed_kind(kind)} {name}" for name, kind in fields if name != _EMPTY]
    return "\n".join(lines)


def _hashed_kind(kind: Any) -> str:
    node, what = kind
    if node == Nodetype.BASE:
        return what[0]
    if node == Nodetype.NAME:
        if what in _TIMES:
            return _TIMES[what]
        return hashlib.md5(_hashed(what).encode()).hexdigest()
    inner, count = what
    name = _hashed_kind(inner)
    if inner[0] == Nodetype.NAME and inner[1] not in _TIMES:
        return name  # an array of messages counts as the message
    return f"{name}[{count if node == Nodetype.ARRAY else ''}]"
