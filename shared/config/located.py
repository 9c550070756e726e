"""Reads a TOML file into a struct; what is wrong is named with file, line and field.

For files with arrays of tables; site files, with their overrides, are read by ``site.py``.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple, TypeVar, get_args

import msgspec

from shared.config import toml
from shared.config.location import line_of
from shared.config.site import nearest
from shared.errors import ConfigError

Key = str | int
S = TypeVar("S", bound=msgspec.Struct)

_UNKNOWN_FIELD = re.compile(r"Object contains unknown field `(?P<field>[^`]*)`")
_MISSING_FIELD = re.compile(r"Object missing required field `(?P<field>[^`]*)`")
_AT = re.compile(r" - at `\$(?P<path>[^`]*)`\Z")
_PATTERN = re.compile(r"Expected `str` matching regex '(?P<pattern>.*)'\Z")
_PART = re.compile(r"\.?(?P<name>[^.\[\]]+)|\[(?P<index>\d+|\.\.\.)\]")


class Problem(NamedTuple):
    """What is wrong with a value that is of the right type."""

    keys: tuple[Key, ...]
    """Where: ``("section", 2, "instruments")``."""
    text: str
    """What it is, and what was expected."""


def read_toml(
    data: bytes, name: str, type: type[S], patterns: Mapping[str, str] = MappingProxyType({})
) -> S:
    """Return the struct that a TOML text holds.

    Args:
        data: the text.
        name: of the file, for messages.
        type: the struct.
        patterns: what a regular expression of the struct asks for, in words.

    Raises:
        ConfigError: it is not TOML, or does not fit: says file, line and field.
    """
    try:
        return toml.decode(data, type)
    except msgspec.ValidationError as error:
        raise ConfigError(sentence(name, data.decode(), _problem(error, type, patterns))) from error
    except ValueError as error:
        raise ConfigError(f"{name}: not TOML: {error}") from error


def sentence(name: str, text: str, problem: Problem) -> str:
    """Return a problem as one line that begins with file, line and field.

    Args:
        name: of the file.
        text: of the file.
        problem: with it.
    """
    line = line_of(text, problem.keys)
    where = f"{name}:{line}" if line else name
    field = _dotted(problem.keys)
    return f"{where}: {field}: {problem.text}" if field else f"{where}: {problem.text}"


def _dotted(keys: Iterable[Key]) -> str:
    """Return keys as people write them; entries of an array count from 1."""
    made = ""
    for key in keys:
        made += f"[{key + 1}]" if isinstance(key, int) else f"{'.' if made else ''}{key}"
    return made


def _problem(
    error: msgspec.ValidationError, type: type[msgspec.Struct], patterns: Mapping[str, str]
) -> Problem:
    message = str(error)
    keys: tuple[Key, ...] = ()
    if at := _AT.search(message):
        keys = tuple(_parts(at["path"]))
        message = message[: at.start()]
    if unknown := _UNKNOWN_FIELD.search(message):
        field = unknown["field"]
        return Problem((*keys, field), f"unknown field; {nearest(field, _fields(type, keys))}")
    if missing := _MISSING_FIELD.search(message):
        return Problem(keys, f"{missing['field']} is missing")
    if message.startswith("Invalid enum value") and (known := _literals(type, keys)):
        return Problem(keys, f"{message[:1].lower()}{message[1:]}; expected {known}")
    if pattern := _PATTERN.search(message):
        words = patterns.get(pattern["pattern"], pattern["pattern"])
        return Problem(keys, f"expected {words}")
    first = re.match(r"\w+", message)
    if first and first.group() in _fields(type, keys):  # said by __post_init__
        return Problem((*keys, first.group()), message)
    return Problem(keys, message[:1].lower() + message[1:])


def _parts(path: str) -> Iterator[Key]:
    for part in _PART.finditer(path):
        if part["name"] is not None:
            yield part["name"]
        elif part["index"] != "...":
            yield int(part["index"])


def _literals(type: object, keys: Sequence[Key]) -> str:
    """Return the words that the field at ``keys`` may be, as a list for people."""
    names = [key for key in keys if isinstance(key, str)]
    found = _struct_at(type, names[:-1])
    if found is None or not names:
        return ""
    fields = msgspec.structs.fields(found)
    annotation = next((f.type for f in fields if f.encode_name == names[-1]), None)
    return ", ".join(repr(word) for word in _words_in(annotation))


def _words_in(annotation: object) -> Iterator[str]:
    for inner in get_args(annotation):
        if isinstance(inner, str):
            yield inner
        else:
            yield from _words_in(inner)


def _fields(type: object, keys: Sequence[Key]) -> list[str]:
    """Return the names of the fields of the struct that stands at ``keys`` in another one."""
    found = _struct_at(type, keys)
    return [] if found is None else [f.encode_name for f in msgspec.structs.fields(found)]


def _struct_at(annotation: object, keys: Sequence[Key]) -> type[msgspec.Struct] | None:
    found = _struct_in(annotation)  # types are values here
    for key in keys:
        if found is not None and isinstance(key, str):
            fields = msgspec.structs.fields(found)
            found = next((_struct_in(f.type) for f in fields if f.encode_name == key), None)
    return found


def _struct_in(annotation: object) -> type[msgspec.Struct] | None:
    """Return the struct in ``tuple[S, ...]``, ``S | None`` and the like."""
    if isinstance(annotation, type) and issubclass(annotation, msgspec.Struct):
        return annotation
    found = (_struct_in(inner) for inner in get_args(annotation))
    return next((each for each in found if each is not None), None)
