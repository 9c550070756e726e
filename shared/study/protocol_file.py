"""Reads a protocol from its TOML file; what is wrong is named with file, line and field."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from importlib import resources
from pathlib import Path
from typing import Final, NamedTuple, TypeVar, get_args

import msgspec

from shared.config import toml
from shared.config.location import line_of
from shared.config.site import nearest
from shared.errors import ConfigError
from shared.study.protocol import ITEM_ID, LANGUAGE, NAME, ONE_LINE, Instrument, Protocol

SHIPPED: Final = ("study-one", "study-two", "template")
"""Names of the protocols that come with the program."""

Key = str | int
S = TypeVar("S", bound=msgspec.Struct)

_UNKNOWN_FIELD = re.compile(r"Object contains unknown field `(?P<field>[^`]*)`")
_MISSING_FIELD = re.compile(r"Object missing required field `(?P<field>[^`]*)`")
_AT = re.compile(r" - at `\$(?P<path>[^`]*)`\Z")
_PATTERN = re.compile(r"Expected `str` matching regex '(?P<pattern>.*)'\Z")
_PATTERNS: Final = {
    NAME: "up to 40 small letters, digits and hyphens",
    ITEM_ID: "up to 40 letters, digits, hyphens and underscores",
    ONE_LINE: "one line without tabs",
    LANGUAGE: "a language such as en or de-CH",
}
_PART = re.compile(r"\.?(?P<name>[^.\[\]]+)|\[(?P<index>\d+|\.\.\.)\]")


class Problem(NamedTuple):
    """What is wrong with a value that is of the right type."""

    keys: tuple[Key, ...]
    """Where: ``("section", 2, "instruments")``."""
    text: str
    """What it is, and what was expected."""


def load_protocol(path: Path) -> Protocol:
    """Return the protocol that a file holds.

    Raises:
        ConfigError: it cannot be read, or a value is unknown, missing, of the wrong type,
            impossible, or names something that is not there: says file, line and field.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ConfigError(f"cannot read protocol {path}: {error.strerror or error}") from error
    return read_protocol(data, str(path))


def read_protocol(data: bytes, name: str) -> Protocol:
    """Return the protocol in the bytes of a file.

    Args:
        data: the file's bytes.
        name: of the file, for messages.

    Raises:
        ConfigError: as ``load_protocol``.
    """
    protocol = read_toml(data, name, Protocol)
    for problem in problems_of(protocol):
        raise ConfigError(_sentence(name, data.decode(), problem))
    return protocol


def shipped_protocol(name: str) -> Path:
    """Return the file of a protocol that comes with the program.

    Raises:
        ConfigError: there is none of this name.
    """
    if name not in SHIPPED:
        raise ConfigError(f"there is no protocol {name!r}; {nearest(name, SHIPPED)}")
    return Path(str(resources.files("shared.study") / "protocols" / f"{name}.toml"))


def read_toml(data: bytes, name: str, type: type[S]) -> S:
    """Return the struct that a TOML text holds.

    Args:
        data: the text.
        name: of the file, for messages.
        type: the struct.

    Raises:
        ConfigError: it is not TOML, or does not fit: says file, line and field.
    """
    try:
        return toml.decode(data, type)
    except msgspec.ValidationError as error:
        raise ConfigError(_sentence(name, data.decode(), _problem(error, type))) from error
    except ValueError as error:
        raise ConfigError(f"{name}: not TOML: {error}") from error


def problems_of(protocol: Protocol) -> Iterator[Problem]:
    """Yield what does not go together in a protocol, in the order of its tables."""
    conditions = [each.name for each in protocol.condition]
    instruments = [each.name for each in protocol.instrument]
    yield from _doubled("baseline", [each.name for each in protocol.baseline])
    yield from _doubled("condition", conditions)
    yield from _doubled("instrument", instruments)
    yield from _order(protocol, conditions)
    if len(protocol.section) != len(conditions):
        yield Problem(
            ("section",),
            f"there are {len(protocol.section)} sections and {len(conditions)} conditions: "
            "each section plays one condition, so write as many",
        )
    for index, section in enumerate(protocol.section):
        yield from _asked(protocol, ("section", index), section.instruments, index + 1)
    yield from _asked(protocol, ("start",), protocol.start.instruments, 0)
    yield from _asked(protocol, ("end",), protocol.end.instruments, len(protocol.section))
    for index, instrument in enumerate(protocol.instrument):
        yield from _instrument(("instrument", index), instrument)


def _order(protocol: Protocol, conditions: Sequence[str]) -> Iterator[Problem]:
    first = protocol.order.first
    keys = ("order", "first")
    for name in first:
        if name not in conditions:
            yield Problem(keys, f"there is no condition {name!r}; {nearest(name, conditions)}")
    if len(set(first)) < len(first):
        yield Problem(keys, "a condition stands here twice")
    free = len(conditions) - len(first)
    if protocol.order.kind == "fixed" and first:
        yield Problem(keys, 'goes with kind = "random" or "williams": all of a fixed order stays')
    elif protocol.order.kind != "fixed" and free < 2:
        yield Problem(
            ("order", "kind"),
            f"{protocol.order.kind!r} needs at least 2 conditions to order, and there "
            f"{'is' if free == 1 else 'are'} {max(free, 0)}: add conditions, or say 'fixed'",
        )


def _asked(
    protocol: Protocol, keys: tuple[Key, ...], names: Sequence[str], finished: int
) -> Iterator[Problem]:
    keys = (*keys, "instruments")
    if len(set(names)) < len(names):
        yield Problem(keys, "an instrument stands here twice")
    known = {each.name: each for each in protocol.instrument}
    for name in names:
        if name not in known:
            yield Problem(keys, f"there is no instrument {name!r}; {nearest(name, known)}")
        elif known[name].is_ranking and finished < 2:
            yield Problem(
                keys,
                f"{name!r} ranks the finished sections, and here there are {finished}: "
                "ask it after the second section or later",
            )


def _instrument(keys: tuple[Key, ...], instrument: Instrument) -> Iterator[Problem]:
    items = instrument.item
    ids = [item.id for item in items]
    if instrument.is_ranking and instrument.is_paged:
        yield Problem((*keys, "is_paged"), "a ranking stands on one page")
    for index, item in enumerate(items):
        if item.id in ids[:index]:
            yield Problem((*keys, "item", index, "id"), f"{item.id!r} stands here twice")
        if (item.scale == "ranking") != instrument.is_ranking:
            yield Problem(
                (*keys, "item", index, "scale"),
                "rankings and other questions must be two instruments",
            )
        if isinstance(item.scale, int) and len(instrument.labels) not in (0, item.scale):
            yield Problem(
                (*keys, "labels"),
                f"there are {len(instrument.labels)} labels, and item {item.id!r} has "
                f"{item.scale} points",
            )


def _doubled(table: str, names: Sequence[str]) -> Iterator[Problem]:
    for name, count in Counter(names).items():
        if count > 1:
            second = [index for index, each in enumerate(names) if each == name][1]
            yield Problem((table, second, "name"), f"{name!r} stands here twice")


def _sentence(name: str, text: str, problem: Problem) -> str:
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


def _problem(error: msgspec.ValidationError, type: type[msgspec.Struct]) -> Problem:
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
        words = _PATTERNS.get(pattern["pattern"], pattern["pattern"])
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
