"""Where log events go: JSON lines in a file, short lines on the console.

Events are fixed strings in past tense, values are keys::

    log = structlog.get_logger()
    log.info("rollout_published", policy_version=12, size_bytes=n)
"""

import dataclasses
import json
import logging
import os
import sys
from collections.abc import Mapping, MutableMapping
from pathlib import Path
from typing import Any, TextIO, TypeAlias

import structlog

MAX_BYTES = 16 << 20
"""A log file is set aside as ``<name>.jsonl.1`` when it has grown to this; one is kept."""

_BOUND = ("service", "run_id", "commit", "timestamp", "level", "event", "exception")
_FIRST = ("timestamp", "level", "service", "event")
Event: TypeAlias = MutableMapping[str, Any]


@dataclasses.dataclass(frozen=True)
class Lines:
    """One event, rendered for both readers."""

    json: str
    console: str
    level: int


class Sinks:
    """A log file that never stops a service, and the console beside it."""

    def __init__(self, path: Path | None, console: TextIO | None, console_level: int) -> None:
        self._path = path
        self._console = console
        self._console_level = console_level
        self._descriptor: int | None = None
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._open(path)

    def emit(self, lines: Lines) -> None:
        """Write one event; a full disk or a closed console loses the line, never the service."""
        if self._console is not None and lines.level >= self._console_level:
            try:
                self._console.write(lines.console + "\n")
                self._console.flush()
            except (OSError, ValueError):
                self._console = None
        if self._descriptor is not None and self._path is not None:
            try:
                os.write(self._descriptor, lines.json.encode() + b"\n")
                if os.fstat(self._descriptor).st_size > MAX_BYTES:
                    self._turn_over(self._path)
            except OSError:
                return

    debug = info = warning = error = critical = exception = emit

    def _open(self, path: Path) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC
        self._descriptor = os.open(path, flags, 0o644)

    def _turn_over(self, path: Path) -> None:
        assert self._descriptor is not None
        os.close(self._descriptor)
        self._descriptor = None
        os.replace(path, path.with_name(path.name + ".1"))
        self._open(path)


def configure_logging(
    path: Path | None, *, console: TextIO | None = None, bound: Mapping[str, str] | None = None
) -> None:
    """Send the log events of this process to ``path`` and to the console.

    Args:
        path: JSON lines are appended here; None for no file.
        console: where short lines go; stderr when None. Everything from ``info`` up on a
            terminal, from ``warning`` up where nobody is looking.
        bound: keys that every event carries: ``service``, ``run_id``, ``commit``.
    """
    stream = sys.stderr if console is None else console
    sinks = Sinks(path, stream, logging.INFO if stream.isatty() else logging.WARNING)
    structlog.contextvars.clear_contextvars()
    structlog.contextvars.bind_contextvars(**(bound or {}))
    structlog.configure(
        processors=[
            structlog.contextvars.merge_contextvars,
            structlog.processors.add_log_level,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.processors.format_exc_info,
            _render,
        ],
        wrapper_class=structlog.make_filtering_bound_logger(logging.INFO),
        logger_factory=lambda *_: sinks,
        cache_logger_on_first_use=False,
    )


def _render(_logger: object, method: str, event: Event) -> tuple[tuple[Lines], dict[str, Any]]:
    """Return the arguments of ``Sinks.emit``."""
    values = " ".join(f"{key}={value}" for key, value in event.items() if key not in _BOUND)
    name, clock = event.get("service", "riposte"), event["timestamp"][11:19]
    console = f"{clock} {name}: {event['event']} {values}".rstrip()
    if "exception" in event:
        console += f" ({event['exception'].splitlines()[-1]})"
    level = logging.getLevelNamesMapping()[event["level"].upper()]
    first = {key: event[key] for key in _FIRST if key in event}
    return (Lines(json.dumps(first | dict(event), default=str), console, level),), {}
