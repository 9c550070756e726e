"""Actors that join a run from other hosts, over mutual TLS, knowing an address and no more."""

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from shared.testing.network.commands import unavailable
from shared.testing.network.hosts import Network
from tests.integration.hosts.cluster import Cluster, Pace, Throttle, until
from tests.integration.small import SMALL
from tests.integration.training.killing import assert_nothing_lost_nor_counted_twice
from tests.integration.training.training import state_of

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.timeout(500),
    pytest.mark.skipif(bool(unavailable()), reason=unavailable()),
]
ELSEWHERE = (*SMALL, "train.record=false", "train.actors=0")
"""A small run whose actors are all on other hosts."""


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    with Network() as network:
        yield Cluster(network, tmp_path)


def finish(cluster: Cluster, process: "subprocess.Popen[bytes]", seconds: float) -> None:
    assert process.wait(seconds) == 0, cluster.said(cluster.learner)


def test_an_actor_of_another_host_is_seen_by_status_and_leaves_when_told(cluster: Cluster):
    desk = cluster.network.host("desk")
    cluster.start(cluster.learner, "router", str(cluster.site), "--run", str(cluster.run))
    cluster.start(cluster.learner, "league", str(cluster.site), "--run", str(cluster.run))
    actor = cluster.join(desk)
    log = cluster.keep_log(desk)
    until(lambda: '"service_started"' in log.read_text())
    seen = {
        (one["host"], one["name"]): one for one in cluster.status("--run-id", "run")["services"]
    }
    assert seen.keys() == {("learner", "router-0"), ("learner", "league-0"), ("desk", log.stem)}
    assert seen["learner", "router-0"]["state"].startswith("carries ")
    assert seen["desk", log.stem]["waiting_for"].startswith("league: ")
    actor.terminate()
    assert actor.wait(60) == 0, cluster.said(desk)
    assert list((cluster.folder / "desk").iterdir()) == []  # the scratch folder is gone


@pytest.mark.slow
def test_an_actor_joins_by_address_alone_and_ends_with_the_run(cluster: Cluster):
    desk = cluster.network.host("desk")
    run = cluster.train(ELSEWHERE)
    actor = cluster.join(desk)
    log = cluster.keep_log(desk)
    finish(cluster, run, 300)
    assert actor.wait(60) == 0, cluster.said(desk)
    assert list((cluster.folder / "desk").iterdir()) == []  # the scratch folder is gone
    assert log.name.startswith("actor-desk-")
    assert_nothing_lost_nor_counted_twice(cluster.run)


@pytest.mark.slow
def test_a_second_host_adds_to_the_rate_and_its_death_costs_its_lease_alone(cluster: Cluster):
    """Two processors are too few for two whole actors: each is let run a fifth of the time."""
    near, far = cluster.network.host("near"), cluster.network.host("far")
    run = cluster.train((*ELSEWHERE, "league.antagonist_updates=4000", "actor.num_envs=4"))
    with Throttle(cluster.join(near), 0.2), cluster.pace() as pace:
        cluster.keep_log(near)
        alone = pace.measure(12.0)
        second = cluster.join(far)
        with Throttle(second, 0.2):
            log = cluster.keep_log(far)
            pace.until_acknowledged(log)
            both = pace.measure(12.0)
            second.kill()
        pace.measure(12.0)  # its lease lapses, unnoticed by the others
        after = pace.measure(12.0)
    assert both > 1.2 * alone, (alone, both, after)
    assert after < both / 1.1, (alone, both, after)
    run.send_signal(signal.SIGINT)
    run.wait(120)
    state = state_of(cluster.run)
    dead = [lease for lease in state.leases.values() if lease.grant.actor == log.stem]
    assert len(dead) == 1
    others = {lease.grant.actor for lease in state.leases.values()} - {log.stem}
    assert len(others) == 1
    boots = {lease.grant.boot for lease in state.leases.values() if lease.grant.actor in others}
    assert len(boots) == 1


@pytest.mark.chaos
def test_a_partition_of_a_minute_heals_by_itself(cluster: Cluster):
    hosts = [cluster.network.host(name) for name in ("near", "far")]
    run = cluster.train(
        (*ELSEWHERE, "league.antagonist_updates=400", "league.protagonist_updates=50")
    )
    actors = [cluster.join(host) for host in hosts]
    logs = [cluster.keep_log(host) for host in hosts]
    with cluster.pace() as pace:
        for log in logs:
            pace.until_acknowledged(log)
    cluster.learner.cut()
    Pace.rest(60.0)
    before = [acknowledged(log) for log in logs]
    cluster.learner.heal()
    until(lambda: all(acknowledged(log) > count for log, count in zip(logs, before, strict=True)))
    assert [actor.poll() for actor in actors] == [None, None]  # the same processes go on
    finish(cluster, run, 300)
    assert [actor.wait(60) for actor in actors] == [0, 0]
    assert_nothing_lost_nor_counted_twice(cluster.run)


def acknowledged(log: Path) -> int:
    return log.read_text().count('"rollout_acknowledged"')
