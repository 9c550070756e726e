"""A league killed at any point of phase two, or of a tournament, goes on as if it never had been.

A kill leaves the ledger's file and its write-ahead log as they stood: copied at that instant, the
log cut anywhere within the transaction that nobody had been told of yet. On each copy another
league is opened and goes on to the end.
"""

import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from services.jobs.settings import Settings
from services.jobs.tournament.plan import Plan
from services.jobs.tournament.results import plan_of, standings_of, table_of
from services.league.config import LeagueConfig
from services.league.events import Entry, RunStarted
from services.league.history import RunState
from services.league.leases import awaits_restart
from services.league.ledger import Ledger, open_read_only
from services.league.sampling import Sampler
from shared.messages.league import Lease
from shared.messages.training import AGENTS
from shared.styles.bouts import BoutTable
from tests.unit.league.driving import Match, snapshot

pytestmark = pytest.mark.timeout(300)  # many commits, each of them synced

POINTS = 24
WAL_SALT = slice(16, 24)
"""Bytes of a write-ahead log's header that change when it is begun anew."""


def both_phases(sampler: Sampler) -> LeagueConfig:
    """Return a short run with every kind of stage."""
    return LeagueConfig(
        iterations=1, antagonist_updates=2, protagonist_updates=2, convergence_min_updates=0,
        evaluation_bouts=5, rounds=2, round_iterations=4, round_antagonist_updates=2,
        round_protagonist_updates=1, sampler=sampler, protagonist_anchors=("scripted:guard",),
        antagonist_anchors=("scripted:stab",),
    )  # fmt: skip


class Peers:
    """Everybody a league talks to; what they do next follows from its state alone."""

    def __init__(self, match: Match, boot: str) -> None:
        self.match, self.boot = match, boot
        self.lease: Lease | None = None
        self.has_played = False

    def step(self) -> bool:
        """Send one message; return whether there was one to send."""
        match, state = self.match, self.match.league.state
        if match.league.finished:
            return False
        match.clock.advance(0.1)
        missing = [agent for agent in AGENTS if state.latest(agent) is None]
        if missing and not state.is_tournament:
            assert match.report(missing[0], 0, -1).accepted
        elif state.stage is not None and awaits_restart(state.stage):
            assert match.report_next().accepted
        elif self.lease is None or self.lease.lease not in state.live_leases:
            self.lease = match.lease(boot=self.boot, num_envs=3)
            assert self.lease.lease
            self.has_played = False
        elif self.lease.kind == "train" and self.has_played:
            assert match.report_next().accepted
            self.has_played = False
        else:
            self._play(self.lease)
        return True

    def _play(self, lease: Lease) -> None:
        """Report bouts whose points follow from the lease's seed."""
        generator = np.random.default_rng(lease.seed)
        count = lease.bouts or 3
        attack = generator.integers(0, 40, count).astype(np.int32)
        features = generator.random((count, 2, 8), np.float32)
        answer = self.match.play(
            lease,
            boot=self.boot,
            attack_steps=attack,
            score=(attack - 10).astype(np.float32),
            features=features if lease.kind == "evaluate" else features[:0],
        )
        assert answer.accepted, answer.reason
        self.has_played = True

    def finish(self) -> None:
        """Go on to the end of the run."""
        while self.step():
            pass


@dataclass(frozen=True)
class Instant:
    """What a kill would have left, and what had been committed."""

    folder: Path
    position: int
    log_bytes: int
    position_before: int
    log_bytes_before: int


def through(match: Match, copies: Path, wanted: int) -> list[Instant]:
    """Take a run to its end; return what kills at so many random points of it would have left.

    Points are drawn after the first round has begun, of a tournament anywhere.
    """
    peers = Peers(match, "b0")
    log = match.folder / "league.sqlite-wal"
    found: list[Instant] = []
    salt = log.read_bytes()[WAL_SALT]
    before = (match.league.ledger_position, log.stat().st_size)
    while peers.step():
        after = (match.league.ledger_position, log.stat().st_size)
        state = match.league.state
        if after != before and (state.is_tournament or (state.stages[-1:] and _in_rounds(state))):
            copy = copies / str(len(found))
            shutil.copytree(match.folder, copy, ignore=shutil.ignore_patterns("*.lock"))
            found.append(Instant(copy, *after, *before))
        before = after
    assert log.read_bytes()[WAL_SALT] == salt  # or sizes of the log would mean nothing
    chosen = np.random.default_rng(5).choice(len(found), min(wanted, len(found)), replace=False)
    return [found[k] for k in sorted(chosen.tolist())]


def _in_rounds(state: RunState) -> bool:
    return state.stages[-1].stage.round > 0


def schedule_of(state: RunState) -> list[tuple[Any, ...]]:
    """Return who met whom, when, and what came of it."""
    return [(r.stage, r.updates, r.restarts, r.end_version, r.end_snapshot) for r in state.stages]


def bouts_of(folder: Path, state: RunState) -> BoutTable:
    return table_of(state, plan_of(folder, state), Settings.load(None))


def assert_same(found: BoutTable, wanted: BoutTable) -> None:
    assert found.provenance == wanted.provenance
    for name in ("antagonist", "protagonist", "bout", "seed", "score", "features"):
        assert getattr(found, name).tobytes() == getattr(wanted, name).tobytes(), name


def assert_same_ratings(found: BoutTable, wanted: BoutTable) -> None:
    one, two = standings_of(found), standings_of(wanted)
    for name in ("bouts", "mean", "low", "high"):
        assert getattr(one.payoff, name).tobytes() == getattr(two.payoff, name).tobytes(), name
    assert one.ratings == two.ratings
    assert one.nash == two.nash


def events_of(folder: Path) -> list[Entry]:
    with open_read_only(folder / "league.sqlite") as ledger:
        return list(ledger.replay())


@pytest.fixture
def folder() -> Iterator[Path]:
    """A folder in memory, where every commit is quick."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as name:
        yield Path(name)


def check(folder: Path, match: Match) -> None:
    """Kill, reopen and finish a run at random points; compare with the run never killed."""
    instants = through(match, folder / "copies", POINTS)
    assert len(instants) >= 20
    whole = match.league.state
    match.stop()
    entries = events_of(match.folder)
    wanted_schedule = schedule_of(whole)
    wanted_bouts = bouts_of(match.folder, whole)
    assert len(wanted_bouts) >= 10
    generator = np.random.default_rng(9)
    for number, instant in enumerate(instants):
        is_torn = number % 2 == 1
        position = instant.position_before if is_torn else instant.position
        if is_torn:
            log = instant.folder / "league.sqlite-wal"
            size = int(generator.integers(instant.log_bytes_before, instant.log_bytes))
            torn = bytearray(log.read_bytes()[:size])
            if number % 4 == 3 and size > instant.log_bytes_before:  # written, but not as meant
                torn[instant.log_bytes_before] ^= 0xFF
            log.write_bytes(torn)
            if number % 8 < 4:  # its index is a cache, and may be lost too
                instant.folder.joinpath("league.sqlite-shm").unlink()
        # What reads it before any league does sees the same.
        assert RunState.fold(events_of(instant.folder)) == RunState.fold(entries[:position])
        other = Match(instant.folder, match.cfg, seed=match.seed)
        state = other.league.state
        assert state == RunState.fold(entries[:position])
        Peers(other, f"b{number + 1}").finish()
        assert state is other.league.state
        assert schedule_of(state) == wanted_schedule
        bouts = bouts_of(instant.folder, state)
        assert_same(bouts, wanted_bouts)
        if number in (0, len(instants) - 1):  # they follow from the bouts, and take their time
            assert_same_ratings(bouts, wanted_bouts)
        other.stop()
        assert RunState.fold(events_of(instant.folder)) == state
        assert events_of(instant.folder)[:position] == entries[:position]


@pytest.mark.parametrize("sampler", ["uniform", "pfsp"])
def test_reopened_at_any_point_of_phase_two_it_draws_plays_and_rates_the_same(
    folder: Path, sampler: Sampler
) -> None:
    match = Match(folder / "run", both_phases(sampler))
    check(folder, match)


def test_reopened_at_any_point_of_a_tournament_it_plays_and_rates_the_same(folder: Path) -> None:
    cfg = LeagueConfig(seed=7)
    run = folder / "run"
    (run / "snapshots").mkdir(parents=True)
    players = {a: tuple(snapshot(a, k).reference for k in range(1, 4)) for a in AGENTS}
    plan = Plan(
        run="x", antagonists=players["antagonist"], protagonists=players["protagonist"], labels={},
        bouts=8, commit="",
    )  # fmt: skip
    ledger = Ledger(run / "league.sqlite")
    ledger.append([RunStarted(run="test", seed=7, serial=False, config=cfg), plan.event], 1)
    ledger.close()
    check(folder, Match(run, cfg))
