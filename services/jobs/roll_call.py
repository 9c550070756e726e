"""Listens to every process of a run, and says who has fallen silent."""

import dataclasses

from services.jobs.status_view import Heard, Missing, Snapshot, lags
from shared.bus.base import Bus
from shared.clock import Clock
from shared.messages.league import Leases
from shared.messages.live import Progress, ServiceStatus
from shared.messages.topics import LEASES, PROGRESS, SERVICE_ROLES, STATUS

MOST_PROCESSES = 20_000
"""That are kept; one heard longest ago goes first."""
FORGET_SECONDS = 600.0
"""A process that has been silent for longer is no more shown."""


@dataclasses.dataclass
class _Row:
    status: ServiceStatus
    heard_at: float
    cpu_percent: float | None = None


class RollCall:
    """What an onlooker has heard so far."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        """Begin to listen."""
        self._bus = bus
        self._clock = clock
        self._statuses = bus.subscribe(STATUS)
        self._progress_said = bus.subscribe(PROGRESS)
        self._leases_said = bus.subscribe(LEASES)
        self._rows: dict[tuple[str, str], _Row] = {}
        self._progress: Progress | None = None
        self._leases: Leases | None = None
        self._alive()  # what lives is told from the first question on

    def listen(self, seconds: float) -> None:
        """Take in what is said within ``seconds``."""
        until = self._clock.now() + seconds
        while (left := until - self._clock.now()) > 0:
            self._bus.wait(left)
            self._take()

    def snapshot(self) -> Snapshot:
        """Return what is known now."""
        now = self._clock.now()
        statuses = [row.status for row in self._rows.values()]
        processes = tuple(
            Heard(
                status=row.status,
                silent_seconds=now - row.heard_at,
                cpu_percent=row.cpu_percent,
                lags=lags(statuses, row.status),
            )
            for _, row in sorted(self._rows.items())
        )
        return Snapshot(processes=processes, missing=self._missing(), progress=self._progress)

    def close(self) -> None:
        """Stop listening."""
        for subscription in (self._statuses, self._progress_said, self._leases_said):
            subscription.close()

    def _take(self) -> None:
        now = self._clock.now()
        while (status := self._statuses.take()) is not None:
            self._hear(status, now)
        while (progress := self._progress_said.take()) is not None:
            self._progress = progress
        while (leases := self._leases_said.take()) is not None:
            self._leases = leases
        for key in [k for k, row in self._rows.items() if now - row.heard_at > FORGET_SECONDS]:
            del self._rows[key]
        while len(self._rows) > MOST_PROCESSES:
            del self._rows[next(iter(self._rows))]

    def _hear(self, status: ServiceStatus, now: float) -> None:
        known = self._rows.pop((status.role, status.name), None)  # the newest stands last
        row = self._rows[status.role, status.name] = _Row(status, now)
        if known is not None and known.status.boot == status.boot and now > known.heard_at:
            used = status.cpu_seconds - known.status.cpu_seconds
            row.cpu_percent = max(0.0, 100.0 * used / (now - known.heard_at))

    def _missing(self) -> tuple[Missing, ...]:
        """Return who is on the bus, or holds a lease, and says nothing."""
        heard = {(role.replace("-", "_"), name) for role, name in self._rows}
        found = dict.fromkeys(self._alive(), "is on the bus and says nothing")
        leases = self._leases.leases if self._leases is not None else ()
        for lease in leases:
            found.setdefault(("actor", lease.actor), f"had lease {lease.lease} a moment ago")
        return tuple(
            Missing(role=role, name=name, why=why)
            for (role, name), why in sorted(found.items())
            if (role, name) not in heard
        )

    def _alive(self) -> set[tuple[str, str]]:
        return {
            (role, name)
            for role in SERVICE_ROLES
            for name in self._bus.alive(role.replace("_", "-"))
        }
