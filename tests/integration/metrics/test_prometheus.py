"""Prometheus scrapes a real endpoint, computes every rule and answers every panel."""

import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from shared.bus.config import BusConfig
from shared.bus.zenoh import ZenohBus, open_zenoh
from shared.clock import SystemClock
from shared.messages.topics import PROGRESS, STATUS
from tests.integration.metrics.prometheus import Prometheus, missing, panels
from tests.integration.metrics.test_endpoint import Site
from tests.unit.metrics.test_service import LEARNER, PROGRESS_NOW

pytestmark = [pytest.mark.zenoh, pytest.mark.skipif(bool(missing), reason=missing)]
LEARNING = msgspec.structs.replace(
    LEARNER, counters=LEARNER.counters | {"rollouts_accepted": 40, "bus_refused_messages": 0}
)
WHO = {"role": "learner", "name": "learner-antagonist"}


class Watched:
    """A router, an endpoint, a learner on the bus, and Prometheus."""

    def __init__(self, site: Site, bus: ZenohBus, prometheus: Prometheus) -> None:
        self.prometheus = prometheus
        self._site = site
        self._bus = bus

    def wait(self, query: str, speaking: bool = True, seconds: float = 60.0) -> dict[str, str]:
        """Return the labels of the first sample of a query, once there is one."""
        deadline = time.monotonic() + seconds
        while not (found := self.prometheus.query(query)):
            assert time.monotonic() < deadline, f"{query}: nothing within {seconds} s"
            if speaking:
                self._bus.publish(STATUS, LEARNING, role="learner", name="learner-antagonist")
                self._bus.publish(PROGRESS, PROGRESS_NOW)
            self._bus.wait(0.2)
        return found[0]["metric"]


@pytest.fixture
def watched(tmp_path: Path) -> Iterator[Watched]:
    site = Site(tmp_path)
    cfg = BusConfig(connect=(site.endpoint,), open_seconds=60.0)
    bus = open_zenoh(cfg, "learner-0", SystemClock(), "r1")
    try:
        (tmp_path / "prometheus").mkdir()
        with Prometheus(tmp_path / "prometheus", site.port) as prometheus:
            yield Watched(site, bus, prometheus)
    finally:
        bus.close()
        site.close()


def test_a_sample_keeps_the_name_of_the_process_it_is_about(watched: Watched):
    labels = watched.wait('riposte_learner_starved_seconds_total{role="learner"}')
    assert labels.items() >= WHO.items()
    assert labels["job"] == "riposte"
    assert watched.wait('up{job="riposte"} == 1')


def test_every_rule_is_computed_and_every_panel_answered(watched: Watched):
    watched.wait("riposte:actor_scaling:starvation")
    for rule in watched.prometheus.rules():
        assert (rule["health"], rule.get("lastError", "")) == ("ok", ""), rule["name"]
    for title, asked in panels().items():
        for expression in asked:
            watched.prometheus.query(expression)  # an error of its language would be raised
            if title in ("Phase", "Update", "Samples", "Score", "Time left", "Staleness", "Memory"):
                assert watched.wait(expression), title


@pytest.mark.slow
def test_a_learner_that_falls_silent_raises_its_alert(watched: Watched):
    firing = 'ALERTS{alertname="RiposteServiceSilent",alertstate="firing"}'
    watched.wait('riposte_service_last_seen_seconds{role="learner"}')
    assert watched.prometheus.query(firing) == []
    assert watched.wait(firing, speaking=False).items() >= WHO.items()
