"""The command lines that made a run, as they were typed: ``commands.txt`` in its folder."""

import contextlib
import shlex
from collections.abc import Sequence
from pathlib import Path

from shared.runtime.files import atomic_write

FILE = "commands.txt"


def note(folder: Path, words: Sequence[str]) -> None:
    """Keep a command line; said twice in a row it is kept once.

    Raises:
        RiposteError: it cannot be written.
    """
    lines = _lines(folder)
    line = shlex.join(["riposte", *words])
    if lines[-1:] != [line]:
        atomic_write(folder / FILE, "".join(f"{one}\n" for one in (*lines, line)).encode())


def made_by(folder: Path) -> str:
    """Return the commands that made the run in a folder, empty where nobody kept them."""
    return " && ".join(_lines(folder))


def _lines(folder: Path) -> list[str]:
    with contextlib.suppress(OSError, UnicodeDecodeError):
        return (folder / FILE).read_text(encoding="utf-8").splitlines()
    return []
