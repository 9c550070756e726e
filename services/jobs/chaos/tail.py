"""Reads what is added to a process's log."""

import json
from pathlib import Path
from typing import Any


class Tail:
    """The new lines of a file of JSON lines, also when it is set aside and begun anew."""

    def __init__(self, path: Path) -> None:
        """Begin at its beginning, whether or not it is there yet."""
        self._path = path
        self._at = 0
        self._file = 0
        self._rest = b""

    def read(self) -> list[dict[str, Any]]:
        """Return the events of the complete lines added since the last call."""
        try:
            with self._path.open("rb") as file:
                number = self._path.stat().st_ino
                if number != self._file:
                    self._file, self._at, self._rest = number, 0, b""
                file.seek(self._at)
                added = file.read()
        except FileNotFoundError:
            return []
        self._at += len(added)
        *lines, self._rest = (self._rest + added).split(b"\n")
        return [event for line in lines if (event := _event(line)) is not None]


def _event(line: bytes) -> dict[str, Any] | None:
    try:
        return json.loads(line)
    except ValueError:  # a line cut short by kill -9, with the next life's first behind it
        return None
