"""The runs of a measurement, a line of JSON each as it ends: a stopped measurement goes on."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from shared.errors import ConfigError, RiposteError

Say = Callable[[str], None]


class KeptRuns:
    """What has been run; runs that are here are not made again."""

    def __init__(self, path: Path, say: Say, *, only_kept: bool = False) -> None:
        """Read a file, if it is there; a last line cut short is left out.

        Args:
            path: of the runs.
            say: told of each run as it ends.
            only_kept: run nothing more; what is missing counts as left out.

        Raises:
            ConfigError: it is not such a file.
        """
        self.skipped: list[str] = []
        """Runs that this machine did not bring to work, and why."""
        self.say = say
        self.only_kept = only_kept
        self._path = path
        self._found: dict[str, dict[str, Any]] = {}
        whole = b""
        for number, line in enumerate(_lines(path), 1):
            try:
                kept = msgspec.json.decode(line, type=dict[str, Any])
                self._found[kept["run"]] = kept["found"]
            except (msgspec.MsgspecError, KeyError) as error:
                raise ConfigError(f"{path}, line {number} is no run: {error}") from error
            whole += line
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(whole)

    def has(self, run: str) -> bool:
        """Return whether a run is here."""
        return run in self._found

    def get(self, run: str, make: Callable[[], dict[str, Any]]) -> dict[str, Any] | None:
        """Return a run, made now unless it is here; None when it cannot be had.

        Args:
            run: names it.
            make: runs it.
        """
        if run not in self._found:
            if self.only_kept:
                self.skipped.append(f"{run}: not run")
                return None
            try:
                found = make()
            except RiposteError as error:  # too much for this machine: the others count
                self.skipped.append(f"{run}: {error}")
                self.say(f"left out: {self.skipped[-1]}")
                return None
            self._found[run] = found
            with self._path.open("ab") as file:
                file.write(msgspec.json.encode({"run": run, "found": found}) + b"\n")
        return self._found[run]


def _lines(path: Path) -> list[bytes]:
    if not path.exists():
        return []
    return [line for line in path.read_bytes().splitlines(keepends=True) if line.endswith(b"\n")]
