"""Documents in which a part is made from the code: it stands between two markers."""

from shared.errors import ConfigError


def renewed(text: str, begin: str, end: str, made: str) -> str:
    """Return a document with what was made now between its markers.

    Raises:
        ConfigError: the markers are not there exactly once, in order.
    """
    first, last = text.find(begin), text.find(end)
    if first < 0 or last < first or text.count(begin) != 1 or text.count(end) != 1:
        raise ConfigError(f"expected one line {begin} and after it one line {end}")
    return f"{text[: first + len(begin)]}\n{made}\n{text[last:]}"
