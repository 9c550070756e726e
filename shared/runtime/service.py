"""A service as its process sees it: something that ticks."""

import dataclasses
import os
import socket
import threading
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Protocol, TypeVar

from shared.bus.base import Bus
from shared.clock import Clock
from shared.messages.live import ServiceStatus
from shared.messages.message import Message
from shared.messages.topics import STATUS, Topic
from shared.runtime.beat import Beat
from shared.runtime.build import commit
from shared.runtime.process import Usage, usage

Out = TypeVar("Out", bound=Message)

IDLE_SECONDS = 0.05
"""How long a service with nothing to do waits for the bus."""
STATUS_PERIOD = 1.0
"""Seconds from one ServiceStatus to the next."""


@dataclasses.dataclass
class Health:
    """How a service is, in its own words."""

    state: str = "starting"
    """What it does now, in a few words."""
    waiting_for: str = ""
    """Whom or what it waits for; empty when it does not."""
    waiting_seconds: float = 0.0
    rates: dict[str, float] = dataclasses.field(default_factory=dict[str, float])
    """Per second, by name with unit: ``samples_per_s``."""
    counters: dict[str, int] = dataclasses.field(default_factory=dict[str, int])
    """Since the process started."""
    last_error: str = ""
    policies: dict[str, int] = dataclasses.field(default_factory=dict[str, int])
    """By agent, the newest policy version that it has."""


class Speaker(Protocol):
    """What a status goes out by: a process's end of the bus, or the router itself."""

    name: str
    boot: str

    @property
    def counters(self) -> Mapping[str, int]:
        """Return counts since the start."""
        ...

    def publish(self, topic: Topic[Out], message: Out, **fields: str) -> None:
        """Send a value."""
        ...


class Healthy(Protocol):
    """Somebody who says how it is."""

    def health(self) -> Health:
        """Return how it is; called once a second, so it must be cheap."""
        ...


class Ticking(Protocol):
    """A service: does what can be done now, says how it is, and ends when told."""

    def tick(self) -> bool:
        """Do everything possible now without blocking; return whether anything was done."""
        ...

    def health(self) -> Health:
        """Return how it is; called once a second, so it must be cheap."""
        ...

    def close(self) -> None:
        """Finish what must not be lost and let go of everything; called once."""
        ...


def version() -> str:
    """Return the installed version of Riposte, ``unknown`` in a bare source tree."""
    try:
        return metadata.version("riposte")
    except metadata.PackageNotFoundError:
        return "unknown"


def run(
    service: Ticking, bus: Bus, clock: Clock, role: str, stop: threading.Event,
    log: Path | None = None,
) -> None:  # fmt: skip
    """Tick ``service`` until ``stop`` is set, and publish its status every second.

    The caller closes the service and the bus; ``log`` is as ``StatusReporter`` has it.

    Raises:
        BusError: the bus was lost for longer than its limit.
    """
    bus.declare_alive(role)
    reporter = StatusReporter(service, bus, clock, role, log)
    while not stop.is_set():
        did = service.tick()
        reporter.tick()
        bus.wait(0.0 if did else IDLE_SECONDS)


class StatusReporter:
    """Publishes the ServiceStatus of one service every second, and beats."""

    def __init__(
        self, service: Healthy, bus: Speaker, clock: Clock, role: str, log: Path | None = None
    ) -> None:
        """Be due at once; ``log`` is the file whose time says that the loop turns."""
        self._service = service
        self._bus = bus
        self._clock = clock
        self._role = role
        self._host = socket.gethostname()
        self._version = version()
        self._beat = Beat(log)
        self._due_at = clock.now()

    def tick(self) -> None:
        """Publish if a second has passed since the last time."""
        now = self._clock.now()
        if now < self._due_at:
            return
        self._due_at = now + STATUS_PERIOD
        self._bus.publish(STATUS, self.status(usage()), role=self._role, name=self._bus.name)
        self._beat.tick()

    def status(self, used: Usage) -> ServiceStatus:
        """Return the status to publish: the service's health, the bus counters, the process."""
        health = self._service.health()
        counters = {f"bus_{name}": count for name, count in self._bus.counters.items()}
        return ServiceStatus(
            role=self._role,
            name=self._bus.name,
            boot=self._bus.boot,
            pid=os.getpid(),
            host=self._host,
            state=health.state,
            waiting_for=health.waiting_for,
            waiting_seconds=health.waiting_seconds,
            rates=dict(health.rates),
            counters=counters | health.counters,
            cpu_seconds=used.cpu_seconds,
            rss_bytes=used.rss_bytes,
            last_error=health.last_error,
            version=self._version,
            commit=commit(),
            policies=dict(health.policies),
        )
