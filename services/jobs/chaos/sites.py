"""Every fault there is, and the kind of run that each of them strikes."""

import contextlib
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from services.jobs.chaos import clock, damage, guests, network, signals
from services.jobs.chaos.faults import Fault
from services.jobs.chaos.job import Job
from services.jobs.chaos.robot import faults as robot
from services.jobs.chaos.robot.far_match import FarMatch
from services.jobs.chaos.robot.match import Match
from services.jobs.chaos.table import Kind
from shared.clock import Clock
from shared.testing.network.commands import unavailable
from shared.testing.network.hosts import Network

Make = Callable[[Path, int], Job]


@dataclass(frozen=True)
class Site:
    """A kind of run."""

    name: str
    faults: tuple[Fault[Any], ...]
    prepare: Callable[[Path, Clock], AbstractContextManager[Make]]
    """Given a folder for the runs, returns what makes one; undoes itself afterwards."""
    why_not: Callable[[], str]
    """Why there can be none here; empty when there can."""
    is_kept: bool = True
    """Whether the folders of its runs are left where they are."""


@contextlib.contextmanager
def _plain(folder: Path, watch: Clock) -> Generator[Make]:
    variables = clock.environment(folder)
    yield lambda at, seed: Job(at, watch, seed=seed, environment=variables, clocks=folder)


@contextlib.contextmanager
def _on_small_disk(folder: Path, watch: Clock) -> Generator[Make]:
    damage.mount_disk(folder)
    try:
        yield lambda at, seed: Job(at, watch, seed=seed)
    finally:
        damage.unmount_disk(folder)


@contextlib.contextmanager
def _split(folder: Path, watch: Clock) -> Generator[Make]:
    del folder
    with Network() as net:
        yield lambda at, seed: network.SplitJob(net, at, watch, seed=seed)


@contextlib.contextmanager
def _match(folder: Path, watch: Clock) -> Generator[Make]:
    variables = clock.environment(folder)
    yield lambda at, seed: Match(at, watch, seed=seed, environment=variables, clocks=folder)


@contextlib.contextmanager
def _match_on_small_disk(folder: Path, watch: Clock) -> Generator[Make]:
    damage.mount_disk(folder)
    try:
        yield lambda at, seed: Match(at, watch, seed=seed, is_recorded=True)
    finally:
        damage.unmount_disk(folder)


@contextlib.contextmanager
def _far_match(folder: Path, watch: Clock) -> Generator[Make]:
    del folder
    with Network() as net:
        yield lambda at, seed: FarMatch(net, at, watch, seed=seed)


def _always() -> str:
    return ""


SITES = (
    Site(
        "training",
        (*signals.FAULTS, damage.FAULTS[0], *clock.FAULTS, *guests.FAULTS),
        _plain,
        _always,
    ),
    Site("disk", damage.FAULTS[1:], _on_small_disk, damage.why_no_disk, is_kept=False),
    Site("network", network.FAULTS, _split, unavailable),
    Site("robot", robot.FAULTS, _match, _always),
    Site(
        "match-on-disk", robot.DISK_FAULTS, _match_on_small_disk, damage.why_no_disk, is_kept=False
    ),
    Site("match-over-network", robot.HOST_FAULTS, _far_match, unavailable),
)
FAULTS: dict[str, Fault[Any]] = {fault.name: fault for site in SITES for fault in site.faults}
ROBOT = frozenset(fault.name for fault in robot.ALL)
KINDS = tuple(Kind(fault.name, fault.what, fault.strikes) for fault in FAULTS.values())
