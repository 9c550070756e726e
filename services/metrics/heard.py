"""What was heard last of every service and of the run; bounded, validated, forgotten in time.

The one thing two threads share: the service hears, the web's thread reads copies.
"""

import dataclasses
import math
import re
import threading

from shared.messages.live import Progress, ServiceStatus

MAX_ENTRIES = 128
"""Rates, and counters, that one service may have."""
MAX_TEXT = 128
"""Characters of a name, a host or a version."""

_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,63}")
_CHUNK = re.compile(r"[A-Za-z0-9._-]{1,128}")


@dataclasses.dataclass(frozen=True)
class Service:
    """One process, as it was heard last."""

    status: ServiceStatus
    heard_at: float
    """By the clock of whoever hears (s)."""
    restarts: int
    """How often it came back under the same name as another process."""


@dataclasses.dataclass(frozen=True)
class Run:
    """The run, as it was heard last."""

    progress: Progress
    heard_at: float


class Heard:
    """Everybody who said something within ``forget_after`` seconds."""

    def __init__(self, forget_after: float, max_services: int) -> None:
        self._forget_after = forget_after
        self._max_services = max_services
        self._lock = threading.Lock()
        self._services: dict[tuple[str, str], Service] = {}
        self._run: Run | None = None

    def hear(self, status: ServiceStatus, now: float) -> str:
        """Keep what a service says; return why not, empty when it was kept."""
        if fault := fault_of_status(status):
            return fault
        key = (status.role, status.name)
        with self._lock:
            before = self._services.get(key)
            if before is None and len(self._services) >= self._max_services:
                return f"there are {self._max_services} services already: metrics.max_services"
            restarts = 0 if before is None else before.restarts
            if before is not None and before.status.boot != status.boot:
                restarts += 1
            self._services[key] = Service(status, now, restarts)
        return ""

    def hear_progress(self, progress: Progress, now: float) -> str:
        """Keep where the run stands; return why not, empty when it was kept."""
        if fault := fault_of_progress(progress):
            return fault
        with self._lock:
            self._run = Run(progress, now)
        return ""

    def forget(self, now: float) -> None:
        """Drop whoever has been silent for too long."""
        oldest = now - self._forget_after
        with self._lock:
            gone = [key for key, service in self._services.items() if service.heard_at < oldest]
            for key in gone:
                del self._services[key]
            if self._run is not None and self._run.heard_at < oldest:
                self._run = None

    def read(self) -> tuple[list[Service], Run | None]:
        """Return everybody, by role and name, and the run."""
        with self._lock:
            return [self._services[key] for key in sorted(self._services)], self._run


def fault_of_status(status: ServiceStatus) -> str:
    """Return what is wrong with a status; empty when it can be shown."""
    for what, text in (("role", status.role), ("name", status.name)):
        if not _CHUNK.fullmatch(text):
            return f"a {what} is {text[:40]!r}, expected letters, digits, '.', '_' or '-'"
    who = f"{status.role} {status.name}"
    for what, text in (("boot", status.boot), ("host", status.host), ("version", status.version)):
        if len(text) > MAX_TEXT:
            return f"{who} has a {what} of {len(text)} characters, at most {MAX_TEXT} are shown"
    for what, entries in (("rates", status.rates), ("counters", status.counters)):
        if len(entries) > MAX_ENTRIES:
            return f"{who} has {len(entries)} {what}, at most {MAX_ENTRIES} are shown"
        for name, value in entries.items():
            if not _NAME.fullmatch(name):
                return f"{who} has {what} named {name[:40]!r}, expected a plain word"
            if not _is_number(value):
                return f"{who} has {what} of which {name} is not a finite number"
    if min([0, *status.counters.values()]) < 0:
        return f"{who} has a counter below zero"
    own = (status.waiting_seconds, status.cpu_seconds, float(status.rss_bytes))
    if not all(_is_number(value) and value >= 0 for value in own):
        return f"{who} has a waiting time, processor time or memory that is none"
    return ""


def fault_of_progress(progress: Progress) -> str:
    """Return what is wrong with a progress; empty when it can be shown."""
    if not _CHUNK.fullmatch(progress.run):
        return f"the run is called {progress.run[:40]!r}, expected letters, digits, '.', '_' or '-'"
    if len(progress.phase) > MAX_TEXT or len(progress.agent) > MAX_TEXT:
        return f"phase and agent of the run are longer than {MAX_TEXT} characters"
    for name in progress.__struct_fields__:
        value = getattr(progress, name)
        if isinstance(value, int | float) and not _is_number(value):
            return f"{name} of the run is not a finite number"
    return ""


def _is_number(value: float) -> bool:
    """Return whether a float can hold it and it is finite."""
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False
