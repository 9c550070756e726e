"""A league that has run for days holds what it needs; the ledger has the rest."""

from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from services.league import history, journal
from services.league.history import RunState
from services.league.ledger import open_read_only
from services.league.progress import progress_of
from shared.messages.topics import RESULTS
from tests.unit.league.driving import SAMPLES, SMALL, Match, bout_results

LONG = msgspec.structs.replace(SMALL, antagonist_updates=100)
KEPT = 5


@pytest.fixture
def match(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Match]:
    monkeypatch.setattr(journal, "REMEMBERED", KEPT)
    monkeypatch.setattr(journal, "REMEMBERED_WINDOWS", 0)
    match = Match(tmp_path, LONG)
    match.both_start()
    yield match
    match.stop()


def everything(match: Match) -> RunState:
    with open_read_only(match.folder / "league.sqlite") as ledger:
        return RunState.fold(ledger.replay())


def learn(match: Match, versions: int) -> None:
    """Play three bouts for each version, and report it."""
    lease = match.lease()
    for number in range(1, versions + 1):
        results = bout_results(lease, "actor-0", "b0", number, attack=100 + number)
        assert match.ask(RESULTS, results).accepted
        assert match.report("antagonist", number, 0).accepted
        assert match.renew(lease).alive


def test_a_stage_holds_its_newest_versions_and_points_and_counts_them_all(match: Match):
    learn(match, 47)
    state, whole = match.league.state, everything(match)
    (stage,), (full,) = state.stages, whole.stages
    assert KEPT <= len(stage.versions) < 2 * KEPT
    assert len(stage.points) <= len(stage.versions)
    assert len(state.versions["antagonist"]) == len(stage.versions) + 1  # and version 0
    assert stage.versions == full.versions[-len(stage.versions) :]
    assert stage.points == full.points[-len(stage.points) :]
    assert (stage.updates, stage.samples, stage.newest) == (47, 47 * SAMPLES, full.versions[-1])
    assert (full.updates, full.samples, full.newest) == (47, 47 * SAMPLES, full.versions[-1])
    assert state.latest("antagonist") == whole.latest("antagonist")
    assert state.rollout_names == whole.rollout_names
    assert msgspec.structs.replace(
        progress_of(LONG, state, 2000, ""), score_mean=0, score_low=0, score_high=0, score_bouts=0
    ) == msgspec.structs.replace(
        progress_of(LONG, whole, 2000, ""), score_mean=0, score_low=0, score_high=0, score_bouts=0
    )


def test_leases_that_ended_long_ago_are_forgotten_and_their_numbers_are_not_used_again(
    match: Match, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(history, "ENDED_LEASES", 3)
    names: list[str] = []
    for _ in range(20):
        names.append(match.lease().lease)
        match.clock.advance(LONG.lease_seconds + 0.1)
    assert len(set(names)) == 20
    state = match.league.state
    assert len(state.ended_leases) < 6
    assert set(state.leases) == {*state.ended_leases, *state.live_leases}
    assert names[-1] in state.leases
    assert set(everything(match).leases) == set(names)
    of_old = msgspec.structs.replace(match.lease(), lease=names[0])
    late = match.ask(RESULTS, bout_results(of_old, "actor-0", "b0", 1))
    assert not late.accepted


def test_a_restarted_league_and_one_that_was_not_decide_the_same(match: Match):
    learn(match, 40)
    before = match.league.state
    match.restart()
    assert match.league.state == before
    for number in range(41, 101):
        match.report("antagonist", number, 0)
    first = match.league.state.stages[0]
    assert (first.end_reason, first.end_version) == ("budget", 100)


def test_a_forgotten_version_is_known_when_it_comes_again(match: Match):
    learn(match, 47)
    assert 3 not in match.league.state.versions["antagonist"]
    position = match.league.ledger_position
    assert match.report("antagonist", 3, 0).accepted
    assert match.league.ledger_position == position


def test_a_learner_that_lost_forgotten_versions_is_told_what_they_were_made_from(match: Match):
    learn(match, 47)
    answer = match.report("antagonist", 3, 0, salt=1.0)
    assert (answer.accepted, answer.latest_version) == (False, 47)
    assert "use a number after the latest" in answer.reason
    assert answer.learned_elsewhere == ("antagonistboot:3-47",)
