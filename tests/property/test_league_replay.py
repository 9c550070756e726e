"""Whatever happens to a league, in whatever order, its ledger says the same as its state."""

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from services.jobs.reproduction.draws import replay as drawn_again
from services.league.config import LeagueConfig
from services.league.history import RunState
from services.league.leases import is_chunk_open
from services.league.ledger import open_read_only
from shared.bus.base import Refused
from shared.messages.league import Lease
from shared.messages.training import AGENTS
from tests.unit.league.driving import SMALL, Match

ACTORS = st.sampled_from(["actor-0", "actor-1"])
BOOTS = st.sampled_from(["b0", "b1"])
STEPS = st.one_of(
    st.tuples(st.just("lease"), ACTORS, BOOTS, st.integers(1, 8)),
    st.tuples(st.just("renew"), st.integers(0, 9)),
    st.tuples(st.just("play"), st.integers(0, 9), st.integers(1, 4), st.booleans()),
    st.tuples(st.just("repeat"), st.integers(0, 9)),
    st.tuples(st.just("version"), st.sampled_from(AGENTS), st.integers(0, 12), st.integers(-1, 4)),
    st.tuples(st.just("next"), st.just(0)),
    st.tuples(st.just("next"), st.just(0)),
    st.tuples(st.just("incident"), st.integers(0, 3)),
    st.tuples(st.just("wait"), st.floats(0.0, 12.0)),
    st.tuples(st.just("restart"), st.just(0)),
)

ROUNDS = LeagueConfig(
    iterations=1, antagonist_updates=1, protagonist_updates=1, convergence_min_updates=0,
    evaluation_bouts=0, rounds=2, round_iterations=3, round_antagonist_updates=1,
    round_protagonist_updates=2, batch_rollouts=4,
)  # fmt: skip
"""In phase two after four steps."""


class Mess:
    """Does the steps, remembering what was acknowledged."""

    def __init__(self, folder: Path, cfg: LeagueConfig) -> None:
        self.match = Match(folder, cfg)
        self.leases: list[tuple[Lease, str, str]] = []
        self.acknowledged: dict[str, int] = {}
        self.versions: dict[tuple[str, int], str] = {}
        self.sent: list[tuple[tuple[Lease, str, str], int, dict[str, Any]]] = []

    def do(self, step: tuple[Any, ...]) -> None:
        getattr(self, step[0])(*step[1:])

    def lease(self, actor: str, boot: str, num_envs: int) -> None:
        lease = self.match.lease(actor, boot, num_envs)
        if lease.lease:
            assert lease.lease not in {known.lease for known, _, _ in self.leases}
            self.leases.append((lease, actor, boot))

    def renew(self, which: int) -> None:
        if self.leases:
            lease, actor, boot = self.leases[-1 - which % len(self.leases)]
            answer = self.match.renew(lease, actor, boot)
            assert answer.alive == (lease.lease in self.match.league.state.live_leases)

    def play(self, which: int, bouts: int, complete: bool) -> None:
        if not self.leases:
            return
        held = self.leases[-1 - which % len(self.leases)]
        changes = {} if held[0].kind == "evaluate" else {"bouts": bouts, "complete": complete}
        self._send(held, self.match.sequence(), changes)

    def repeat(self, which: int) -> None:
        if self.sent:
            self._send(*self.sent[-1 - which % len(self.sent)])

    def _send(self, held: tuple[Lease, str, str], sequence: int, changes: dict[str, Any]) -> None:
        lease, actor, boot = held
        name, state = f"{boot}:{sequence}", self.match.league.state
        granted = state.leases[lease.lease].grant
        wanted = name in self.acknowledged or (
            lease.kind == "train" or is_chunk_open(state, granted)
        )
        answer = self.match.play(lease, actor, boot, sequence=sequence, **changes)
        assert answer.accepted == wanted
        if answer.accepted:
            self.acknowledged[name] = self.acknowledged.get(name, 0) + 1
        self.sent.append((held, sequence, changes))

    def version(self, agent: Any, version: int, stage: int) -> None:
        answer = self.match.report(agent, version, stage)
        if not isinstance(answer, Refused) and answer.accepted:
            self.versions[agent, version] = ""

    def next(self, _: int) -> None:
        """Report what a learner in its stage would."""
        state = self.match.league.state
        if state.stage is None:
            self.match.both_start()
        else:
            assert self.match.report_next().accepted

    def incident(self, number: int) -> None:
        assert self.match.note(number).accepted

    def wait(self, seconds: float) -> None:
        self.match.clock.advance(seconds)
        self.match.league.tick()

    def restart(self, _: int) -> None:
        self.match.restart()


@pytest.mark.parametrize("cfg", [SMALL, ROUNDS], ids=["phase-one", "phase-two"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(steps=st.lists(STEPS, max_size=60))
def test_replay_is_the_live_state_and_everything_acknowledged_is_there_once(
    cfg: LeagueConfig, steps: list[tuple[Any, ...]]
) -> None:
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as name:
        mess = Mess(Path(name), cfg)
        for step in steps:
            mess.do(step)
        state = mess.match.league.state
        with open_read_only(Path(name) / "league.sqlite") as ledger:
            entries = list(ledger.replay())
        assert RunState.fold(entries) == state
        played = [e.event.key for e in entries if e.event.kind == "bouts"]
        assert sorted(played) == sorted(mess.acknowledged)
        versions = [e.event.key for e in entries if e.event.kind == "version"]
        assert len(versions) == len(set(versions))
        assert {f"{agent}:{number}" for agent, number in mess.versions} <= set(versions)
        for draw in drawn_again(entries)[1]:
            assert draw.is_replayed
        held = [(state.leases[lease].grant, lease) for lease in state.live_leases]
        assert state.training_leases == sum(grant.work == "train" for grant, _ in held)
        assert sorted((a, lease) for a, own in state.live_leases_of.items() for lease in own) == (
            sorted((grant.actor, lease) for grant, lease in held)
        )
        for record in state.evaluations.values():
            assert sum(record.played) == record.done
        for record in state.stages:
            counted = sum(len(point.score) for point in record.points)
            assert counted == record.complete_bouts
        mess.match.stop()
