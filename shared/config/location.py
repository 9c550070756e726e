"""Where a key stands in a TOML text: for messages only, so a near miss is harmless."""

import re
from collections.abc import Sequence

# Of a stripped line; possessive, for a line of spaces must not be tried in every way there is.
_HEADER = re.compile(r"\[\[?+(?P<name>[^\]]++)\]\]?+\s*+(#.*)?+\Z")
_KEY = re.compile(r"(?P<name>[\w\"'.\s-]++)=")


def line_of(text: str, keys: Sequence[str]) -> int:
    """Return the 1-based line on which the dotted ``keys`` is set or opened.

    The line of the nearest enclosing table where the key itself is not found, 0 where nothing is.
    """
    table: tuple[str, ...] = ()
    best, best_depth = 0, 0
    wanted = tuple(keys)
    for number, line in enumerate(text.splitlines(), start=1):
        line = line.strip()
        if header := _HEADER.match(line):
            table = found = _split(header["name"])
        elif assignment := _KEY.match(line):
            found = table + _split(assignment["name"])
        else:
            continue
        if wanted[: len(found)] == found and len(found) > best_depth:
            best, best_depth = number, len(found)
    return best


def _split(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip().strip("\"'") for part in dotted.split("."))
