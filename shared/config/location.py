"""Where a key stands in a TOML text: for messages only, so a near miss is harmless."""

import re
from collections.abc import Sequence

# Of a stripped line; possessive, for a line of spaces must not be tried in every way there is.
_HEADER = re.compile(r"\[\[?+(?P<name>[^\]]++)\]\]?+\s*+(#.*)?+\Z")
_KEY = re.compile(r"(?P<name>[\w\"'.\s-]++)=")


def line_of(text: str, keys: Sequence[str | int]) -> int:
    """Return the 1-based line on which the dotted ``keys`` is set or opened.

    The line of the nearest enclosing table where the key itself is not found, 0 where nothing is.

    Args:
        text: TOML.
        keys: a number counts the entries of an array of tables from 0; where there is none the
            first entry that has the key is meant.
    """
    table: tuple[str | int, ...] = ()
    counts: dict[tuple[str | int, ...], int] = {}
    best, best_depth = 0, 0
    wanted = tuple(keys)
    is_counted = any(isinstance(key, int) for key in wanted)
    for number, line in enumerate(text.splitlines(), start=1):
        line = line.strip()
        if header := _HEADER.match(line):
            table = found = _table(_split(header["name"]), line.startswith("[["), counts)
        elif assignment := _KEY.match(line):
            found = table + _split(assignment["name"])
        else:
            continue
        if not is_counted:
            found = tuple(key for key in found if isinstance(key, str))
        elif len(found) > len(wanted) and isinstance(found[-1], int):
            found = found[:-1]  # the array itself is wanted
        if wanted[: len(found)] == found and len(found) > best_depth:
            best, best_depth = number, len(found)
    return best


def _table(
    names: tuple[str, ...], is_array: bool, counts: dict[tuple[str | int, ...], int]
) -> tuple[str | int, ...]:
    """Return the names of a header with the numbers of the array entries they stand in."""
    found: tuple[str | int, ...] = ()
    for depth, name in enumerate(names, start=1):
        found += (name,)
        if is_array and depth == len(names):
            counts[found] = counts.get(found, -1) + 1
        if found in counts:
            found += (counts[found],)
    return found


def _split(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))
