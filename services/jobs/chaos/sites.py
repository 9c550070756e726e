"""Every fault there is, and the kind of run that each of them strikes."""

import contextlib
from collections.abc import Callable, Generator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from functools import partial
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
Prepare = Callable[[Path, Clock], AbstractContextManager[Make]]


@dataclass(frozen=True)
class Site:
    """A kind of run."""

    name: str
    faults: tuple[Fault[Any], ...]
    prepare: Prepare
    """Given a folder for the runs, returns what makes one; undoes itself afterwards."""
    why_not: Callable[[], str]
    """Why there can be none here; empty when there can."""
    is_kept: bool = True
    """Whether the folders of its runs are left where they are."""


def _plain(kind: type[Job]) -> Prepare:
    """Return what makes runs whose processes' clocks can be stepped."""

    @contextlib.contextmanager
    def prepare(folder: Path, watch: Clock) -> Generator[Make]:
        variables = clock.environment(folder)
        yield lambda at, seed: kind(at, watch, seed=seed, environment=variables, clocks=folder)

    return prepare


def _on_small_disk(kind: Callable[..., Job]) -> Prepare:
    """Return what makes runs on a disk of their own, which is soon full."""

    @contextlib.contextmanager
    def prepare(folder: Path, watch: Clock) -> Generator[Make]:
        damage.mount_disk(folder)
        try:
            yield lambda at, seed: kind(at, watch, seed=seed)
        finally:
            damage.unmount_disk(folder)

    return prepare


def _over_network(kind: Callable[..., Job]) -> Prepare:
    """Return what makes runs with another host."""

    @contextlib.contextmanager
    def prepare(folder: Path, watch: Clock) -> Generator[Make]:
        del folder
        with Network() as net:
            yield lambda at, seed: kind(net, at, watch, seed=seed)

    return prepare


def _always() -> str:
    return ""


SITES = (
    Site(
        "training",
        (*signals.FAULTS, damage.FAULTS[0], *clock.FAULTS, *guests.FAULTS),
        _plain(Job),
        _always,
    ),
    Site("disk", damage.FAULTS[1:], _on_small_disk(Job), damage.why_no_disk, is_kept=False),
    Site("network", network.FAULTS, _over_network(network.SplitJob), unavailable),
    Site("robot", robot.FAULTS, _plain(Match), _always),
    Site(
        "match-on-disk",
        robot.DISK_FAULTS,
        _on_small_disk(partial(Match, is_recorded=True)),
        damage.why_no_disk,
        is_kept=False,
    ),
    Site("match-over-network", robot.HOST_FAULTS, _over_network(FarMatch), unavailable),
)
FAULTS: dict[str, Fault[Any]] = {fault.name: fault for site in SITES for fault in site.faults}
ROBOT = frozenset(fault.name for fault in robot.ALL)
KINDS = tuple(Kind(fault.name, fault.what, fault.strikes) for fault in FAULTS.values())
