"""Reads a site file: TOML sections converted into the frozen structs that declare them.

What a user can get wrong is answered in one line with the file, the line and the nearest name.
"""

import difflib
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, cast

import msgspec
import tomli_w

from shared.config import toml
from shared.config.location import line_of
from shared.errors import ConfigError

S = TypeVar("S", bound=msgspec.Struct)
Table = dict[str, Any]

SECTIONS = (
    "bus", "sim", "game", "action", "reward",
    "site", "actor", "learner", "league", "recorder", "policy", "referee", "robot_io", "safety",
    "pr2", "vive", "heart_rate", "tones", "page", "study", "metrics", "play",
    "train",
)  # fmt: skip
"""Every section a site file may have; each service reads its own."""

_BARE_WORD = re.compile(r"[A-Za-z_./~][\w./:~@+-]*\Z")
_UNKNOWN_FIELD = re.compile(r"Object contains unknown field `(?P<field>[^`]*)`")
_AT = re.compile(r" - at `\$\.?(?P<path>[^`]*)`\Z")


def load_section(
    path: Path | None, section: str, type: type[S], overrides: Sequence[str] = ()
) -> S:
    """Return one section of a site file, with defaults for what it leaves out.

    Args:
        path: the site file; None means defaults only.
        section: name of the section, one of ``SECTIONS``.
        type: the struct that declares it.
        overrides: ``section.key=value`` with TOML values, applied last; those of other sections
            are left to the services that read them.

    Raises:
        ConfigError: the file cannot be read; a section or key is unknown; a value is of the wrong
            type or out of range.
    """
    if section not in SECTIONS:
        raise ValueError(f"{section!r} is not in shared.config.site.SECTIONS")
    text = _read(path)
    tables = _parse(path, text)
    _check_names(path, text, tables)
    own = [
        (keys, value, text) for keys, value, text in map(_override, overrides) if keys[0] == section
    ]
    table: Table = tables.get(section, {})
    for keys, value, _ in own:
        _put(table, keys[1:], value)
    try:
        return msgspec.convert(table, type)
    except msgspec.ValidationError as error:
        raise _explain(error, path, text, section, type, [item[2] for item in own]) from error


def load_site(
    path: Path | None, types: Mapping[str, type[msgspec.Struct]], overrides: Sequence[str] = ()
) -> dict[str, msgspec.Struct]:
    """Return several sections by name; what a command checks before it starts anything.

    Raises:
        ConfigError: as ``load_section``.
    """
    return {name: load_section(path, name, type, overrides) for name, type in types.items()}


def raw_sections(
    path: Path | None, sections: Sequence[str], overrides: Sequence[str] = ()
) -> dict[str, Table]:
    """Return sections as they are written, with the overrides put in, for somebody else to check.

    Args:
        path: the site file; None means none.
        sections: their names; those that are nowhere are left out.
        overrides: as in ``load_section``.

    Raises:
        ConfigError: the file cannot be read or has an unknown section.
    """
    text = _read(path)
    tables = _parse(path, text)
    _check_names(path, text, tables)
    for keys, value, _ in map(_override, overrides):
        _put(tables, keys, value)
    return {name: tables[name] for name in sections if name in tables}


def dump(sections: Mapping[str, msgspec.Struct]) -> str:
    """Return the TOML text of resolved sections; ``load_section`` reads the same values back.

    A field that is None is left out, for TOML has no null: its default must be None.
    """
    tables = {name: _without_none(msgspec.to_builtins(value)) for name, value in sections.items()}
    return tomli_w.dumps(tables)


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the words that help after an unknown name: the nearest one, or all of them."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.6)
    if close:
        return f"did you mean {close[0]!r}?"
    return f"known: {', '.join(names)}" if names else "none are known"


def _read(path: Path | None) -> str:
    if path is None:
        return ""
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"cannot read site file {path}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"site file {path} is not UTF-8 text") from error


def _parse(path: Path | None, text: str) -> Table:
    try:
        return toml.parse(text)
    except ValueError as error:
        raise ConfigError(f"{path}: not TOML: {error}") from error


def _check_names(path: Path | None, text: str, tables: Table) -> None:
    for name, table in tables.items():
        where = f"{path}:{line_of(text, (name,))}"
        if name not in SECTIONS:
            raise ConfigError(f"{where}: unknown section [{name}]; {nearest(name, SECTIONS)}")
        if not isinstance(table, dict):
            raise ConfigError(f"{where}: {name} must be a section, [{name}], not a value")


def _override(text: str) -> tuple[list[str], Any, str]:
    """Return keys, value and the text of ``section.key=value``."""
    name, equals, value = text.partition("=")
    keys = [key.strip() for key in name.split(".")]
    if not equals or len(keys) < 2 or not all(keys):
        raise ConfigError(f"--set {text}: expected section.key=value, as in sim.half_distance=1.2")
    if keys[0] not in SECTIONS:
        raise ConfigError(f"--set {text}: unknown section; {nearest(keys[0], SECTIONS)}")
    return keys, _toml_value(text, value.strip()), text


def _toml_value(text: str, value: str) -> Any:  # TOML values are of any type
    try:
        tables = toml.parse(f"value = {value}")
    except ValueError as error:
        if _BARE_WORD.match(value):
            return value
        raise ConfigError(
            f"--set {text}: {value!r} is not a TOML value; strings with spaces need quotes"
        ) from error
    if tables.keys() != {"value"}:
        raise ConfigError(f"--set {text}: one value only")
    return tables["value"]


def _put(table: Table, keys: Sequence[str], value: object) -> None:
    for key in keys[:-1]:
        inner = table.setdefault(key, {})
        if not isinstance(inner, dict):
            raise ConfigError(f"--set {'.'.join(keys)}: {key} is a value, not a table")
        table = cast(Table, inner)
    table[keys[-1]] = value


def _explain(
    error: msgspec.ValidationError,
    path: Path | None,
    text: str,
    section: str,
    type: type[msgspec.Struct],
    overrides: Sequence[str],
) -> ConfigError:
    message = str(error).removeprefix(f"{section}.")
    keys: list[str] = []
    if at := _AT.search(message):
        keys = [key for key in re.sub(r"\[.*", "", at["path"]).split(".") if key]
        message = message[: at.start()]
    if unknown := _UNKNOWN_FIELD.search(message):
        message = f"unknown key; {nearest(unknown['field'], _fields(type, keys))}"
        keys = [*keys, unknown["field"]]
    if not keys:  # raised by __post_init__: its text names the field
        first = re.match(r"\w+", message)
        named = first.group() if first and first.group() in _fields(type, []) else ""
        where = _where(path, text, section, [named] if named else [], overrides)
        return ConfigError(f"{where}[{section}] {message}")
    where = _where(path, text, section, keys, overrides)
    message = message[:1].lower() + message[1:]
    return ConfigError(f"{where}[{section}] {'.'.join(keys)}: {message}")


def _where(
    path: Path | None, text: str, section: str, keys: Sequence[str], overrides: Sequence[str]
) -> str:
    name = ".".join([section, *keys])
    for override in reversed(overrides):
        if override.partition("=")[0].replace(" ", "") == name:
            return f"--set {override}: "
    if path is None:
        return ""
    line = line_of(text, (section, *keys))
    return f"{path}:{line}: " if line else f"{path}: "


def _fields(type: Any, keys: Sequence[str]) -> list[str]:  # types are values here
    for key in keys:
        inner = [field.type for field in msgspec.structs.fields(type) if field.encode_name == key]
        if not inner or not _is_struct(inner[0]):
            return []
        type = inner[0]
    return [field.encode_name for field in msgspec.structs.fields(type)]


def _is_struct(candidate: object) -> bool:
    return isinstance(candidate, type) and issubclass(candidate, msgspec.Struct)


def _without_none(value: Any) -> Any:  # builtins as msgspec made them
    if isinstance(value, dict):
        items = cast(Table, value).items()
        return {key: _without_none(item) for key, item in items if item is not None}
    if isinstance(value, list | tuple):
        return [_without_none(item) for item in cast(Sequence[Any], value)]
    return value
