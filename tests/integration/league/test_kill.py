"""``kill -9`` on a league that is busy: nothing it acknowledged is lost or counted twice."""

import os
import random
import signal
import socket
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest

from services.league.history import RunState
from services.league.ledger import open_read_only
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.delivery import Outbox
from shared.bus.routing import open_router
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.league import BoutResults, Incident, Lease, LeaseRequest
from shared.messages.topics import INCIDENT, LEASE, RESULTS, VERSION
from shared.messages.training import Receipt, VersionReceipt, VersionReport
from tests.unit.league.driving import bout_results, version_report

KILLS = 20
ACTOR, BOOT = "actor-0", "b0"


@pytest.fixture
def endpoint() -> Iterator[str]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    router = open_router(BusConfig(listen=(endpoint,)))
    yield endpoint
    router.close()


class Load:
    """An actor, a learner and a supervisor that never stop talking."""

    def __init__(self, bus: Bus) -> None:
        clock = SystemClock()
        self.bus = bus
        self.results = Outbox[BoutResults, Receipt](bus, RESULTS, clock, window=16, timeout=1.0)
        self.versions = Outbox[VersionReport, VersionReceipt](
            bus, VERSION, clock, window=2, timeout=1.0
        )
        self.incidents = Outbox[Incident, Receipt](bus, INCIDENT, clock, window=2, timeout=1.0)
        self.lease = Lease(lease="", kind="none")
        self.sent = Counter[str]()
        self.acknowledged: list[str] = []

    def ready(self) -> None:
        """Report version 0 of both agents and get a training lease."""
        self.versions.put(version_report("antagonist", 0, -1))
        self.versions.put(version_report("protagonist", 0, -1))
        self.drain()
        while not self.lease.lease:
            request = LeaseRequest(actor=ACTOR, boot=BOOT, num_envs=128)
            pending = self.bus.ask(LEASE, request, timeout=5.0)
            while (answer := pending.take()) is None:
                self.bus.wait(0.05)
            if isinstance(answer, Lease):
                self.lease = answer

    def turn(self, *, more: bool = True) -> None:
        """Send what the windows allow, take the answers."""
        while more and not self.results.full:
            number = self.sent["results"]
            self.sent["results"] += 1
            self.results.put(bout_results(self.lease, ACTOR, BOOT, number))
        while more and not self.versions.full:
            self.sent["versions"] += 1
            self.versions.put(version_report("antagonist", self.sent["versions"], 0))
        while more and not self.incidents.full:
            number = self.sent["incidents"]
            self.sent["incidents"] += 1
            self.incidents.put(
                Incident(source="s", boot="s0", sequence=number, kind="k", detail="", at_ns=0)
            )
        for results, receipt in self.results.pump():
            assert receipt.accepted, receipt
            self.acknowledged.append(f"bouts {results.name}")
        for version, answer in self.versions.pump():
            assert answer.accepted, answer
            self.acknowledged.append(f"version {version.agent}:{version.policy_version}")
        for incident, receipt in self.incidents.pump():
            assert receipt.accepted, receipt
            self.acknowledged.append(f"incident s:s0:{incident.sequence}")
        for outbox in (self.results, self.versions, self.incidents):
            assert not outbox.take_refused()
        self.bus.wait(0.01)

    def drain(self) -> None:
        """Take the answers to everything sent."""
        while any(o.unacknowledged for o in (self.results, self.versions, self.incidents)):
            self.turn(more=False)


def start(folder: Path, endpoint: str) -> "subprocess.Popen[bytes]":
    command = [
        sys.executable, "-m", "services.league", "--name", "league-0", "--run", str(folder),
        "--run-id", "killed", "--connect", endpoint,
        "--set", "league.antagonist_updates=1000000", "--set", "league.lease_seconds=600.0",
        "--set", "league.convergence_min_updates=0",
    ]  # fmt: skip
    return subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=Path(__file__).parents[3]
    )


@pytest.mark.zenoh
@pytest.mark.chaos
@pytest.mark.timeout(180)
def test_killed_at_random_points_the_ledger_holds_all_that_was_acknowledged_once(
    tmp_path: Path, endpoint: str
) -> None:
    generator = random.Random(3)
    bus = open_zenoh(BusConfig(connect=(endpoint,)), "driver", SystemClock(), "killed")
    load = Load(bus)
    league = start(tmp_path, endpoint)
    try:
        load.ready()
        for _ in range(KILLS):
            enough = len(load.acknowledged) + generator.randint(1, 60)
            while len(load.acknowledged) < enough:
                load.turn()
            bus.wait(generator.uniform(0.0, 0.01))  # anywhere between two commits, or in one
            os.kill(league.pid, signal.SIGKILL)
            league.wait()
            with open_read_only(tmp_path / "league.sqlite") as ledger:
                keys = {f"{e.event.kind} {e.event.key}" for e in ledger.replay()}
            assert set(load.acknowledged) <= keys
            league = start(tmp_path, endpoint)
        load.drain()
        league.terminate()
        assert league.wait(10.0) == 0
    finally:
        league.kill()
        league.wait()
        bus.close()

    assert len(load.acknowledged) == len(set(load.acknowledged))
    with open_read_only(tmp_path / "league.sqlite") as ledger:
        entries = list(ledger.replay())
    counts = Counter(f"{e.event.kind} {e.event.key}" for e in entries)
    assert all(counts[name] == 1 for name in load.acknowledged)
    assert sum(e.event.kind == "bouts" for e in entries) == load.sent["results"]
    state = RunState.fold(entries)
    assert state.stages[0].complete_bouts == 3 * load.sent["results"]
    assert state.latest_version("antagonist") == load.sent["versions"]
    assert state.repeated_rollouts == 0
