"""A service process with a timed bus: ``python -m benchmarks.counted_service services.actor ...``.

Every call into the bus, and into what it returned, is timed by the CPU clock of the calling
thread, so encoding, decoding, sending and waiting all count; beside it stands what each other
thread has used. A line of totals goes to ``RUN/bus-cost/<name>.jsonl`` twice a second.
"""

import dataclasses
import importlib
import json
import sys
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from shared.bus.base import Bus
from shared.clock import Clock
from shared.runtime.serve import ServeArgs, open_site_bus, serve

PERIOD = 0.5
T = TypeVar("T")


class Meter:
    """CPU nanoseconds of one thread inside the bus."""

    def __init__(self) -> None:
        self.total_ns = 0
        self._depth = 0

    def timed(self, call: Callable[..., T]) -> Callable[..., T]:
        """Return the same call, timed."""

        def run(*args: Any, **kwargs: Any) -> T:
            if self._depth:
                return call(*args, **kwargs)
            self._depth = 1
            begin = time.thread_time_ns()
            try:
                return call(*args, **kwargs)
            finally:
                self.total_ns += time.thread_time_ns() - begin
                self._depth = 0

        return run


class Counted:
    """A subscription, an inbox, a pending answer or a request, timed."""

    def __init__(self, meter: Meter, inner: Any) -> None:
        self._meter = meter
        self._inner = inner

    @property
    def message(self) -> Any:
        """Return what was asked."""
        return self._inner.message

    @property
    def dropped(self) -> int:
        """Return how many values a subscription threw away."""
        return self._inner.dropped

    def take(self) -> Any:
        """Return what the inner one has; a request is timed, too."""
        found = self._meter.timed(self._inner.take)()
        return Counted(self._meter, found) if hasattr(found, "reply") else found

    def reply(self, message: Any) -> None:
        """Answer."""
        self._meter.timed(self._inner.reply)(message)

    def refuse(self, reason: str, *, retry: bool = False) -> None:
        """Answer with an error."""
        self._meter.timed(self._inner.refuse)(reason, retry=retry)

    def close(self) -> None:
        """Let go."""
        self._inner.close()


class CountedBus:
    """A bus whose calls are timed."""

    def __init__(self, bus: Bus, path: Path) -> None:
        self.name = bus.name
        self.boot = bus.boot
        self._bus = bus
        self._meter = Meter()
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("w", encoding="utf-8", buffering=1)
        self._due_at = 0.0

    @property
    def counters(self) -> Mapping[str, int]:
        """Return the inner bus's counts."""
        return self._bus.counters

    def publish(self, *args: Any, **fields: Any) -> None:
        """Send a value."""
        self._meter.timed(self._bus.publish)(*args, **fields)

    def subscribe(self, *args: Any, **fields: Any) -> Any:
        """Listen."""
        return Counted(self._meter, self._bus.subscribe(*args, **fields))

    def answer(self, *args: Any, **fields: Any) -> Any:
        """Offer a service."""
        return Counted(self._meter, self._bus.answer(*args, **fields))

    def ask(self, *args: Any, **fields: Any) -> Any:
        """Send a request."""
        return Counted(self._meter, self._meter.timed(self._bus.ask)(*args, **fields))

    def declare_alive(self, role: str) -> None:
        """Let others see this process."""
        self._bus.declare_alive(role)

    def alive(self, role: str) -> frozenset[str]:
        """Return who is alive."""
        return self._meter.timed(self._bus.alive)(role)

    def wait(self, timeout: float) -> bool:
        """Wait; now and then write the totals."""
        now = time.monotonic()
        if now >= self._due_at:
            self._due_at = now + PERIOD
            self._file.write(json.dumps(dataclasses.asdict(self._totals(now))) + "\n")
        return self._meter.timed(self._bus.wait)(timeout)

    def close(self) -> None:
        """Leave the bus."""
        self._file.close()
        self._bus.close()

    def _totals(self, now: float) -> "Totals":
        return Totals(now, time.process_time(), self._meter.total_ns / 1e9, thread_seconds())


@dataclasses.dataclass(frozen=True)
class Totals:
    """CPU seconds of a process so far."""

    at: float
    """By ``time.monotonic``."""
    process: float
    calls: float
    """Inside the bus, on the service's own thread."""
    threads: dict[str, float]
    """All other threads, by name."""


def thread_seconds() -> dict[str, float]:
    """Return what the threads of this process but the main one have used, by name."""
    used: dict[str, float] = {}
    for task in Path("/proc/self/task").iterdir():
        if int(task.name) == threading.main_thread().native_id:
            continue
        try:
            name = (task / "comm").read_text().strip()
            seconds = int((task / "schedstat").read_text().split()[0]) / 1e9
        except OSError:  # it ended just now
            continue
        used[name] = used.get(name, 0.0) + seconds
    return used


def main() -> int:
    """Run the service that the command line names."""
    module, *argv = sys.argv[1:]
    service: Any = importlib.import_module(f"{module}.__main__")
    role = module.rpartition(".")[2]
    if role == "router":  # all of it is bus
        return int(service.main(argv))

    def open_counted(args: ServeArgs, clock: Clock) -> Bus:
        path = args.run / "bus-cost" / f"{args.name}.jsonl"
        return CountedBus(open_site_bus(args, clock), path)  # type: ignore[return-value]

    return serve(role, service.build, argv, open_bus=open_counted)


if __name__ == "__main__":
    sys.exit(main())
