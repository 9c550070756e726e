"""Documents in which a part is made from the code: it stands between two markers."""

import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from shared.errors import ConfigError, RiposteError


def renewed(text: str, begin: str, end: str, made: str) -> str:
    """Return a document with what was made now between its markers.

    Raises:
        ConfigError: the markers are not there exactly once, in order.
    """
    first, last = text.find(begin), text.find(end)
    if first < 0 or last < first or text.count(begin) != 1 or text.count(end) != 1:
        raise ConfigError(f"expected one line {begin} and after it one line {end}")
    return f"{text[: first + len(begin)]}\n{made}\n{text[last:]}"


def renew(path: Path, begin: str, end: str, made: str) -> bool:
    """Renew what stands between a file's markers; say on standard error why not, if it failed."""
    try:
        old = path.read_text("utf-8")
        new = renewed(old, begin, end, made)
        if new != old:
            path.write_text(new, "utf-8")
    except (OSError, UnicodeDecodeError, RiposteError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        sys.stderr.write(f"{path}: {reason}\n")
        return False
    return True


def renew_main(
    module: str, begin: str, end: str, describe: Callable[[], str], argv: Sequence[str] | None
) -> int:
    """Renew what stands between the markers of the one file that a command names.

    Args:
        module: that the command runs, for its usage.
        begin: the first marker.
        end: the last one.
        describe: makes what stands between them.
        argv: its words; those of this process if None.

    Returns:
        The exit code.
    """
    words = sys.argv[1:] if argv is None else argv
    if len(words) != 1:
        sys.stderr.write(f"usage: python -m {module} FILE\n")
        return 2
    return 0 if renew(Path(words[0]), begin, end, describe()) else 2
