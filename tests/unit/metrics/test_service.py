"""What is heard on a memory bus, as the page of metrics."""

import contextlib
from collections.abc import Iterator
from typing import Any

import msgspec
import pytest

from services.metrics.config import MetricsConfig
from services.metrics.families import FAMILIES
from services.metrics.heard import MAX_ENTRIES
from services.metrics.service import HUNG_SECONDS, Metrics
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.live import Progress, ServiceStatus
from shared.messages.topics import PROGRESS, STATUS
from tests.unit.metrics.test_exposition import read

LEARNER = ServiceStatus(
    role="learner", name="learner-antagonist", boot="b0", pid=7, host="big", state="version 3",
    waiting_for="actors: rollouts", waiting_seconds=2.5,
    rates={"samples_per_s": 900.0, "policy_lag": 1.5},
    counters={"starved_ms": 4500, "rollouts_dropped": 2}, cpu_seconds=12.0, rss_bytes=1 << 20,
    version="0.1.0",
)  # fmt: skip
PROGRESS_NOW = Progress(
    run="r1", stage=1, stages=4, phase="one", iteration=1, agent="protagonist", update=3,
    max_updates=120, total_samples=1000, score_mean=15.0, score_low=14.0, score_high=16.0,
    score_bouts=64, eta_seconds=125.0, dropped_rollouts=5, policy_lag_mean=0.5,
)  # fmt: skip


class Stand:
    """An endpoint, and somebody who says things to it."""

    def __init__(self, **settings: Any) -> None:
        self.clock = ManualClock(100.0)
        hub = MemoryHub(self.clock)
        self.other = hub.join("other")
        cfg = MetricsConfig(port=0, **settings)
        self.metrics = Metrics(cfg, hub.join("metrics-0"), self.clock)

    def say(self, **changes: Any) -> None:
        status = msgspec.structs.replace(LEARNER, **changes)
        self.other.publish(STATUS, status, role=status.role, name=status.name)
        self.metrics.tick()

    def read(self) -> dict[str, float]:
        """Every sample: its name, and the labels that tell it from others of that name."""
        found: dict[str, float] = {}
        for (name, labels), value in read(self.metrics.page()).items():
            told = [text for key, text in labels if key not in ("role", "name", "run")]
            found["|".join([name, *told])] = value
        return found


@pytest.fixture
def stand() -> Iterator[Stand]:
    made = Stand()
    with contextlib.closing(made.metrics):
        yield made


def test_a_service_is_shown_with_all_it_says(stand: Stand):
    stand.say()
    stand.clock.advance(3.0)
    assert stand.read() == {
        "riposte_service_info|b0|big|0.1.0": 1.0,
        "riposte_service_last_seen_seconds": 3.0,
        "riposte_service_restarts_total": 0.0,
        "riposte_service_rate|policy_lag": 1.5,
        "riposte_service_rate|samples_per_s": 900.0,
        "riposte_service_events_total|rollouts_dropped": 2.0,
        "riposte_service_events_total|starved_ms": 4500.0,
        "riposte_service_waiting_seconds|actors": 2.5,
        "riposte_service_error": 0.0,
        "riposte_service_cpu_seconds_total": 12.0,
        "riposte_service_memory_bytes": float(1 << 20),
        "riposte_learner_starved_seconds_total": 4.5,
        "riposte_learner_policy_lag_versions": 1.5,
        "riposte_metrics_refused_total": 0.0,
    }


def test_the_run_is_shown_and_what_is_not_known_is_left_out(stand: Stand):
    stand.other.publish(PROGRESS, PROGRESS_NOW)
    stand.metrics.tick()
    shown = stand.read()
    assert shown["riposte_run_info|protagonist|one"] == 1.0
    assert shown["riposte_run_samples_total"] == 1000.0
    assert shown["riposte_run_dropped_rollouts_total"] == 5.0
    assert [shown[f"riposte_run_score|{bound}"] for bound in ("low", "mean", "high")] == [
        14.0, 15.0, 16.0,
    ]  # fmt: skip
    assert shown["riposte_run_eta_seconds"] == 125.0

    unknown = msgspec.structs.replace(PROGRESS_NOW, eta_seconds=-1.0, score_bouts=0)
    stand.other.publish(PROGRESS, unknown)
    stand.metrics.tick()
    assert not any("eta" in name or "score|" in name for name in stand.read())


def test_a_service_that_left_disappears_after_the_stated_time(stand: Stand):
    stand.say()
    stand.clock.advance(60.0)
    stand.metrics.tick()
    assert stand.read()["riposte_service_last_seen_seconds"] == 60.0
    stand.clock.advance(1.5)
    stand.metrics.tick()
    assert stand.read() == {"riposte_metrics_refused_total": 0.0}


def test_a_process_that_comes_back_under_its_name_is_counted(stand: Stand):
    for boot in ("b0", "b1", "b1", "b2"):
        stand.say(boot=boot)
    assert stand.read()["riposte_service_restarts_total"] == 2.0


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"name": "x" * 200}, "a name is"),
        ({"role": "x" * 200}, "a role is"),
        ({"host": "h" * 129}, "has a host of 129 characters"),
        ({"rates": {"samples per s": 1.0}}, "expected a plain word"),
        ({"rates": {"samples_per_s": float("nan")}}, "samples_per_s is not a finite number"),
        ({"rates": {"samples_per_s": float("inf")}}, "samples_per_s is not a finite number"),
        ({"counters": {f"c{k}": 1 for k in range(MAX_ENTRIES + 1)}}, "129 counters"),
        ({"counters": {"drops": -1}}, "a counter below zero"),
        ({"rss_bytes": -1}, "memory that is none"),
    ],
)
def test_what_cannot_be_a_metric_is_refused_and_counted(
    stand: Stand, changes: dict[str, Any], reason: str
):
    stand.say(**changes)
    assert stand.read() == {"riposte_metrics_refused_total": 1.0}
    health = stand.metrics.health()
    assert reason in health.last_error
    assert health.counters["statuses_refused"] == 1


def test_a_run_with_a_number_that_is_none_is_refused(stand: Stand):
    stand.other.publish(PROGRESS, msgspec.structs.replace(PROGRESS_NOW, approx_kl=float("nan")))
    stand.metrics.tick()
    assert stand.read() == {"riposte_metrics_refused_total": 1.0}


def test_more_services_than_allowed_are_refused_and_those_known_stay():
    made = Stand(max_services=2)
    with contextlib.closing(made.metrics):
        for name in ("a", "b", "c", "a"):
            made.say(name=name, boot="b1" if name == "a" else "b0")
        shown = read(made.metrics.page())
    names = {dict(labels)["name"] for (name, labels) in shown if name.startswith("riposte_serv")}
    assert names == {"a", "b"}
    assert shown[("riposte_metrics_refused_total", ())] == 1.0


def test_healthz_fails_when_the_service_does_not_tick(stand: Stand):
    answer = stand.metrics.answer("/healthz")
    assert answer is not None
    assert answer.status == 200
    stand.clock.advance(HUNG_SECONDS + 1.0)
    answer = stand.metrics.answer("/healthz")
    assert answer is not None
    assert answer.status == 503


def test_a_name_is_given_to_one_family_and_says_its_unit():
    names = [family.name for family in FAMILIES]
    assert len(set(names)) == len(names)
    for family in FAMILIES:
        assert family.name.endswith("_total") == (family.kind == "counter"), family.name
