"""Many actors in one process: everything of an actor but its simulator.

Each has its own session on the bus, its own lease from the league, its subscriptions, its status
every second and its outbox; instead of playing it sends one recorded rollout again and again, at a
set rate, and waits for the acknowledgements like a real one. A line of totals goes to a file
every second: ``python -m benchmarks.scaling.synthetic --help``.
"""

import argparse
import contextlib
import dataclasses
import time
from pathlib import Path

import msgspec
import numpy as np

from benchmarks.scaling import recorded
from services.actor.config import ActorConfig
from services.actor.leasing import LeaseKeeper
from shared.bus.base import Bus
from shared.bus.config import BusConfig
from shared.bus.delivery import Outbox
from shared.bus.zenoh import open_zenoh
from shared.clock import Clock, SystemClock
from shared.messages.topics import POLICY, ROLLOUT
from shared.messages.training import AGENTS, Agent, PolicyAnnouncement, Receipt, Rollout
from shared.runtime.process import set_process_name, usage
from shared.runtime.service import Health, StatusReporter

SWEEP_SECONDS = 0.02
"""Least time from one look at all actors to the next."""
REPORT_SECONDS = 1.0


class Totals(msgspec.Struct, kw_only=True):
    """What all actors of one process have done since it started."""

    at: float = 0.0
    """By the monotonic clock (s)."""
    actors: int = 0
    leased: int = 0
    """Of them with work now."""
    put: int = 0
    """Rollouts handed to the delivery code."""
    accepted: int = 0
    dropped: int = 0
    held_back: int = 0
    """Times that a rollout was due and the window was full."""
    asks: int = 0
    """Requests sent, repeated ones included."""
    bytes_out: int = 0
    cpu_seconds: float = 0.0
    rss_bytes: int = 0


@dataclasses.dataclass(frozen=True)
class Pace:
    """When rollouts are due."""

    period: float
    """Seconds from one rollout of an actor to its next; 0: as fast as they are acknowledged."""
    first_at: float


class SyntheticActor:
    """One actor without a simulator."""

    def __init__(self, bus: Bus, clock: Clock, rollout: Rollout, pace: Pace) -> None:
        """Join; work begins with the first tick."""
        cfg = ActorConfig()
        self.bus = bus
        self.put = self.accepted = self.dropped = self.held_back = 0
        steps, worlds = rollout.rewards.shape
        self.keeper = LeaseKeeper(bus, clock, worlds, steps, cfg.ask_timeout)
        self._clock = clock
        self._rollout = rollout
        self._pace = pace
        self._due_at = pace.first_at
        self._policies = {agent: bus.subscribe(POLICY, agent=agent) for agent in AGENTS}
        self._newest: dict[Agent, PolicyAnnouncement] = {}
        self._outbox: Outbox[Rollout, Receipt] = Outbox(
            bus, ROLLOUT, clock, window=1, timeout=cfg.acknowledge_timeout, agent="antagonist"
        )
        self._reporter = StatusReporter(self, bus, clock, "actor")
        bus.declare_alive("actor")

    def tick(self) -> bool:
        """Take what arrived, send what is due, do the bus's upkeep; return whether it did much."""
        for _, receipt in self._outbox.pump():
            self.accepted += receipt.accepted
            self.dropped += not receipt.accepted
        self.dropped += len(self._outbox.take_refused())
        for agent, subscription in self._policies.items():
            while (announcement := subscription.take()) is not None:
                self._newest[agent] = announcement
        self.keeper.tick()
        self._reporter.tick()
        did = self._send()
        self.bus.wait(0.0)
        return did

    def _send(self) -> bool:
        lease, now = self.keeper.lease, self._clock.now()
        policy = self._newest.get("antagonist")
        if lease is None or lease.stage is None or policy is None or now < self._due_at:
            return False
        self._outbox.window = lease.window
        if self._outbox.full:
            self.held_back += 1
            self._due_at = now + self._pace.period
            return False
        self._outbox.put(
            recorded.under(
                self._rollout, lease, actor=self.bus.name, boot=self.bus.boot, sequence=self.put,
                version=policy.policy_version, snapshot=policy.snapshot,
            )
        )  # fmt: skip
        self.put += 1
        self._due_at = max(self._due_at + self._pace.period, now - self._pace.period)
        return True

    def health(self) -> Health:
        """Return what a status says of it."""
        return Health(state="replays a rollout", counters={"rollouts_acknowledged": self.accepted})

    def close(self) -> None:
        """Leave the bus."""
        self.bus.close()


def totals(actors: list[SyntheticActor], at: float) -> Totals:
    """Return what they have done so far."""
    counters = [actor.bus.counters for actor in actors]
    used = usage()
    return Totals(
        at=at,
        actors=len(actors),
        leased=sum(actor.keeper.lease is not None for actor in actors),
        put=sum(actor.put for actor in actors),
        accepted=sum(actor.accepted for actor in actors),
        dropped=sum(actor.dropped for actor in actors),
        held_back=sum(actor.held_back for actor in actors),
        asks=sum(counts["asks"] for counts in counters),
        bytes_out=sum(counts["bytes_out"] for counts in counters),
        cpu_seconds=used.cpu_seconds,
        rss_bytes=used.rss_bytes,
    )


def parse() -> argparse.Namespace:
    """Return the words of the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--connect", required=True, metavar="ENDPOINT")
    parser.add_argument("--run-id", required=True)
    parser.add_argument("--name", required=True, help="of the process; its actors are NAME-0, ...")
    parser.add_argument("--actors", type=int, required=True)
    parser.add_argument("--rollout", type=Path, required=True, help="file of the recorded rollout")
    parser.add_argument("--period", type=float, required=True, help="seconds between two of one")
    parser.add_argument("--link-lease", type=float, default=2.0, help="bus.lease_seconds")
    parser.add_argument("--out", type=Path, required=True, help="file of totals (JSON lines)")
    return parser.parse_args()


def main() -> None:
    """Be many actors until killed."""
    found = parse()
    set_process_name(found.name)
    rollout = recorded.read(found.rollout)
    clock = SystemClock()
    cfg = BusConfig(
        connect=(found.connect,), open_seconds=60.0, shared_memory=False,
        lease_seconds=found.link_lease,
    )  # fmt: skip
    phases = np.random.default_rng(0).uniform(0.0, found.period, found.actors)
    with contextlib.ExitStack() as stack, found.out.open("ab", buffering=0) as out:
        actors: list[SyntheticActor] = []
        report_at = clock.now()
        while True:
            began_at = clock.now()
            if len(actors) < found.actors:  # one at a time, so that those that are in keep up
                number = len(actors)
                bus = open_zenoh(cfg, f"{found.name}-{number}", clock, found.run_id)
                stack.callback(bus.close)
                pace = Pace(found.period, clock.now() + float(phases[number]))
                actors.append(SyntheticActor(bus, clock, rollout, pace))
            did = [actor.tick() for actor in actors]
            if clock.now() >= report_at:
                report_at = clock.now() + REPORT_SECONDS
                out.write(msgspec.json.encode(totals(actors, time.monotonic())) + b"\n")
            left = SWEEP_SECONDS - (clock.now() - began_at)
            is_complete = len(actors) == found.actors
            if left > 0 and is_complete and not (found.period == 0.0 and any(did)):
                time.sleep(left)


if __name__ == "__main__":
    main()
