"""The metrics' work: bus in, numbers kept, a page made of them when somebody asks."""

import http
from itertools import chain

import structlog

from services.metrics.config import MetricsConfig
from services.metrics.exposition import CONTENT_TYPE, Sample, render
from services.metrics.families import FAMILIES, REFUSED, samples_of, samples_of_run
from services.metrics.heard import Heard
from services.metrics.web import Answer, Web
from shared.bus.base import Bus
from shared.clock import Clock
from shared.messages.topics import PROGRESS, STATUS
from shared.runtime.rate import Rate
from shared.runtime.service import Health

TAKE_MOST = 1024
"""Statuses taken in one tick, so that a flood cannot hold up the rest."""
FORGET_PERIOD = 1.0
"""From one look for services that left to the next (s)."""
HUNG_SECONDS = 10.0
"""``/healthz`` fails when the service has not ticked for so long."""

log = structlog.get_logger()


class Metrics:
    """Hears everybody, and answers Prometheus; a service that ticks."""

    def __init__(self, cfg: MetricsConfig, bus: Bus, clock: Clock) -> None:
        """Listen and serve.

        Raises:
            ConfigError: it cannot serve there.
        """
        self._clock = clock
        self._heard = Heard(cfg.forget_after, cfg.max_services)
        self._refused = 0
        self._last_error = ""
        self._ticked_at = self._forget_due = clock.now()
        self._rate = Rate(clock)
        self._web = Web(cfg.host, cfg.port, self.answer)
        self.port = self._web.port
        self._status = bus.subscribe(STATUS)
        self._progress = bus.subscribe(PROGRESS)

    def tick(self) -> bool:
        """Keep what has arrived, forget who left; return whether anything arrived."""
        now = self._ticked_at = self._clock.now()
        taken = 0
        while taken < TAKE_MOST and (status := self._status.take()) is not None:
            taken += 1
            self._note(self._heard.hear(status, now))
        self._rate.add(taken)
        if (progress := self._progress.take()) is not None:
            taken += 1
            self._note(self._heard.hear_progress(progress, now))
        if now >= self._forget_due:
            self._forget_due = now + FORGET_PERIOD
            self._heard.forget(now)
        return taken > 0

    def _note(self, fault: str) -> None:
        if not fault:
            return
        self._refused += 1
        if fault != self._last_error:
            log.warning("status_refused", reason=fault)
        self._last_error = fault

    def answer(self, path: str) -> Answer | None:
        """Return what a path is answered with; called on the web's thread, changes nothing."""
        if path == "/metrics":
            return Answer(http.HTTPStatus.OK, CONTENT_TYPE, self.page())
        if path == "/healthz":
            silent = self._clock.now() - self._ticked_at
            if silent > HUNG_SECONDS:
                body = f"the service has not looked at the bus for {silent:.0f} s\n".encode()
                return Answer(http.HTTPStatus.SERVICE_UNAVAILABLE, "text/plain", body)
            return Answer(http.HTTPStatus.OK, "text/plain", b"ok\n")
        return None

    def page(self) -> bytes:
        """Return the page of metrics."""
        now = self._clock.now()
        services, run = self._heard.read()
        samples = chain(
            chain.from_iterable(samples_of(service, now) for service in services),
            samples_of_run(run, now) if run is not None else (),
            [Sample(REFUSED, {}, self._refused)],
        )
        return render(FAMILIES, samples)

    def health(self) -> Health:
        """Return whom it hears, and what it could not show."""
        services, run = self._heard.read()
        return Health(
            state=f"{len(services)} services on port {self.port}",
            waiting_for="" if services or run else "anybody",
            rates={"statuses_per_s": self._rate.per_second()},
            counters={**self._web.counters, "statuses_refused": self._refused},
            last_error=self._last_error,
        )

    def close(self) -> None:
        """Stop serving and listening."""
        self._web.close()
        self._status.close()
        self._progress.close()
