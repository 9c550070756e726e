"""TOML of anybody's making: read in bounded time, and refused with one kind of error.

The parser of the standard library takes seconds over a key of ten thousand parts, runs out of
stack on nested lists, and has three kinds of errors of its own.
"""

import datetime
import re
import tomllib
from typing import Any, TypeVar

import msgspec

T = TypeVar("T")

MAX_BYTES = 1 << 20
MAX_KEY_PARTS = 32
"""Of a dotted key; the parser's time grows with their square."""

_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MAX_KEY_PARTS}}}")
_TIMES = (datetime.datetime, datetime.date, datetime.time)


def parse(data: bytes | str) -> dict[str, Any]:
    """Return the tables of a text.

    Raises:
        ValueError: too long, not UTF-8, nested too deeply, or not TOML; says which and where.
    """
    if len(data) > MAX_BYTES:
        raise ValueError(f"{len(data)} bytes are too many, at most {MAX_BYTES} are read")
    text = data.decode("utf-8") if isinstance(data, bytes) else data
    if found := _LONG_KEY.search(text):
        line = text.count("\n", 0, found.start()) + 1
        raise ValueError(f"a key has more than {MAX_KEY_PARTS} parts (at line {line})")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def decode(data: bytes, type: type[T]) -> T:
    """Return the struct that a text holds.

    Raises:
        msgspec.ValidationError: it is TOML, and does not fit; a ValueError, too.
        ValueError: as ``parse``.
    """
    return msgspec.convert(parse(data), type, builtin_types=_TIMES, str_keys=True)
