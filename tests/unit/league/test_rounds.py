"""Phase two by the schedule: whose turn it is, who can be drawn, when it ends."""

from itertools import pairwise
from pathlib import Path

import msgspec
import pytest

from services.league.config import LeagueConfig
from services.league.history import RunState
from services.league.rounds import Turn, next_turn, phase_one_done, pool_of
from services.league.schedule import next_event, total_stages
from shared.messages.training import AGENTS
from tests.unit.league.driving import Match

CFG = LeagueConfig(
    iterations=1, antagonist_updates=2, protagonist_updates=2, convergence_min_updates=0,
    evaluation_bouts=2, rounds=2, round_iterations=3, round_antagonist_updates=2,
    round_protagonist_updates=1,
)  # fmt: skip
TURNS = [Turn(r, i, a) for r in (1, 2) for i in (1, 2, 3) for a in AGENTS]


def played(folder: Path, cfg: LeagueConfig = CFG) -> RunState:
    match = Match(folder, cfg)
    match.finish()
    match.stop()
    return match.league.state


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> RunState:
    """A run of both phases."""
    return played(tmp_path_factory.mktemp("whole"))


def test_every_round_takes_its_turns_antagonist_first(whole: RunState) -> None:
    state = whole
    assert state.finished
    rounds = [record for record in state.stages if record.stage.round]
    assert [Turn(r.stage.round, r.stage.iteration, r.stage.agent) for r in rounds] == TURNS
    assert total_stages(CFG) == len(state.stages) == 2 + len(TURNS)
    for record in rounds:
        stage = record.stage
        assert (stage.phase, stage.score_weight, stage.shaping_weight) == ("two", 1.0, 0.0)
        assert record.updates == stage.max_updates == (2 if stage.agent == "antagonist" else 1)
        assert stage.start == ("warm" if stage.iteration == 1 else "continue")
        assert record.restarts == (stage.iteration == 1)
    assert next_event(CFG, state) is None


def test_a_rounds_history_is_its_own_and_begins_with_the_warm_start(whole: RunState) -> None:
    state = whole
    warm = state.warm_start()
    assert warm is not None
    for turn in TURNS:
        is_antagonist = turn.agent == "antagonist"
        other = AGENTS[1 if is_antagonist else 0]
        pool = pool_of(CFG, state, turn)
        ends = [record.end_ref for record in state.stage_ends(other, turn.round)]
        assert pool.history == (warm[AGENTS.index(other)], *ends)
        assert len(set(pool.history)) == 4
        assert pool.anchors == ()
    first = [r.stage.opponent for r in state.stages if r.stage.round and r.stage.iteration == 1]
    assert first[0] == first[2] == warm[1]  # nobody else has left anything yet


def test_the_newest_only_is_what_the_other_side_has_just_left(tmp_path: Path) -> None:
    state = played(tmp_path, msgspec.structs.replace(CFG, sampler="latest"))
    rounds = [record for record in state.stages if record.stage.round]
    for before, record in pairwise(rounds):
        if record.stage.round == before.stage.round:
            assert record.stage.opponent == before.end_ref


def test_anchors_are_drawn_from_the_opponents_side(tmp_path: Path) -> None:
    cfg = msgspec.structs.replace(
        CFG, antagonist_anchors=("scripted:stab",), protagonist_anchors=("scripted:guard",),
        anchor_share=1.0,
    )  # fmt: skip
    for record in played(tmp_path, cfg).stages:
        if record.stage.round:
            by_antagonist = record.stage.agent == "antagonist"
            wanted = "scripted:guard" if by_antagonist else "scripted:stab"
            assert record.stage.opponent == wanted


def test_a_finished_run_is_taken_up_again_for_more_rounds(tmp_path: Path, whole: RunState) -> None:
    before = played(tmp_path, msgspec.structs.replace(CFG, rounds=0))
    assert before.finished
    assert phase_one_done(CFG, before)
    assert before.library() == []
    for ends, rounds in ((2, 1), (3, 2)):
        cfg = msgspec.structs.replace(CFG, rounds=rounds)
        match = Match(tmp_path, cfg)
        assert next_turn(cfg, match.league.state) == Turn(rounds, 1, "antagonist")
        match.league.tick()
        while match.league.state.stage is not None:
            match.learn_stage()
        match.stop()
        after = match.league.state
        assert (after.finished, after.ends) == (True, ends)
        assert [number for number, _, _ in after.library()] == list(range(1, rounds + 1))
        assert after.evaluation_total == before.evaluation_total  # it is not played again
    assert [r.stage for r in after.stages] == [r.stage for r in whole.stages]
    assert after.library() == whole.library()


def test_fewer_rounds_than_played_end_the_run_and_lose_none(tmp_path: Path) -> None:
    both = played(tmp_path)
    match = Match(tmp_path, msgspec.structs.replace(CFG, rounds=1))
    match.league.tick()
    assert match.league.finished
    assert match.league.state.library() == both.library()
    match.stop()


def test_there_is_no_work_until_the_learner_is_back_at_the_warm_start(tmp_path: Path) -> None:
    match = Match(tmp_path, CFG)
    match.both_start()
    for _ in AGENTS:
        match.learn_stage()
    match.evaluate()
    record = match.league.state.stage
    assert record is not None
    assert record.stage.round == 1
    assert match.lease().kind == "none"
    assert match.league.health().waiting_for == "learner antagonist"
    assert match.report_next().accepted  # made from no rollout: it went back
    assert (record.restarts, record.updates) == (1, 0)
    lease = match.lease()
    assert (lease.kind, lease.stage) == ("train", record.stage)
    match.stop()


def test_a_stage_of_a_round_ends_by_its_updates_however_flat_its_scores(tmp_path: Path) -> None:
    cfg = msgspec.structs.replace(
        CFG, round_antagonist_updates=6, convergence_min_updates=2, convergence_window=1,
        antagonist_updates=6,
    )  # fmt: skip
    state = played(tmp_path, cfg)
    reasons = {(r.stage.phase, r.stage.agent): r.end_reason for r in state.stages}
    assert reasons["two", "antagonist"] == "budget"


def test_an_unfinished_round_is_not_in_the_library(tmp_path: Path) -> None:
    match = Match(tmp_path, CFG)
    match.both_start()
    for _ in AGENTS:
        match.learn_stage()
    match.evaluate()
    for done in range(len(TURNS)):
        rounds = [number for number, _, _ in match.league.state.library()]
        assert rounds == [r for r in (1, 2) if done >= 6 * r]
        match.learn_stage()
    assert len(match.league.state.library()) == 2
    match.stop()


@pytest.mark.parametrize("key", ["rounds", "round_iterations", "round_protagonist_updates"])
def test_counts_out_of_range_are_refused_by_name(key: str) -> None:
    with pytest.raises(ValueError, match=key):
        LeagueConfig(**{key: -1})
