"""A learner at the start of a round: back to the warm start, once, whatever happens meanwhile."""

from pathlib import Path

import msgspec
import numpy as np
import pytest
from numpy.typing import NDArray

from services.learner.checkpoint import CheckpointStore
from shared.errors import CheckpointError
from shared.messages.league import LeaseSummary, Stage
from shared.messages.training import Receipt, VersionReport
from shared.policy.snapshot import unpack
from tests.unit.learner.making import rollout
from tests.unit.learner.test_gate import LEASE, STAGE
from tests.unit.learner.test_service import Table


def turn(index: int, round: int, iteration: int = 1, agent: str = "antagonist") -> Stage:
    return msgspec.structs.replace(
        STAGE, index=index, phase="two", round=round, iteration=iteration, agent=agent,
        score_weight=1.0, shaping_weight=0.0, start="warm" if iteration == 1 else "continue",
    )  # fmt: skip


def lease_of(stage: Stage) -> LeaseSummary:
    return msgspec.structs.replace(LEASE, stage=stage.index)


def enter(table: Table, stage: Stage) -> None:
    """Let the league begin a stage."""
    table.schedule(stage, (lease_of(stage),))


def learn(table: Table, stage: Stage) -> VersionReport:
    """Make one update in a stage."""
    table.send(stage=stage.index)
    return table.accept(stage.index)


def weights(report: VersionReport) -> list[NDArray[np.float32]]:
    found = unpack(report.payload.tobytes(), report.snapshot).weights
    layers = [array for layer in found.layers for array in layer]
    return [found.obs_mean, found.obs_std, found.log_std, *layers]


def are_same(one: VersionReport, other: VersionReport) -> bool:
    return all(np.array_equal(*pair) for pair in zip(weights(one), weights(other), strict=True))


@pytest.fixture
def warm(tmp_path: Path) -> tuple[Table, VersionReport]:
    """A learner at the end of phase one, and its last version."""
    table = Table(tmp_path)
    table.warm()
    return table, learn(table, STAGE)


def test_every_round_begins_with_a_version_made_from_nothing_that_is_the_warm_start(
    warm: tuple[Table, VersionReport],
) -> None:
    table, last = warm
    seen: list[VersionReport] = []
    for number, index in ((1, 2), (2, 8)):
        stage = turn(index, number)
        enter(table, stage)
        begun = table.accept(index)
        assert begun.policy_version == (seen[-1] if seen else last).policy_version + 1
        assert (begun.stage, begun.rollouts, begun.metrics) == (index, (), None)
        assert are_same(begun, last)
        enter(table, stage)  # said again: it is there already
        assert table.versions.take() is None
        learned = learn(table, stage)
        assert not are_same(learned, last)
        assert learned.rollouts
        seen.append(learned)
    assert not are_same(*seen)


def test_within_a_round_it_goes_on_with_what_it_has(warm: tuple[Table, VersionReport]) -> None:
    table, _ = warm
    enter(table, turn(2, 1))
    table.accept(2)
    before = learn(table, turn(2, 1))
    enter(table, turn(3, 1, agent="protagonist"))
    stage = turn(4, 1, iteration=2)
    enter(table, stage)
    assert table.versions.take() is None
    after = learn(table, stage)
    assert after.policy_version == before.policy_version + 1
    assert after.rollouts


def test_rollouts_of_the_round_before_are_not_learned_from(
    warm: tuple[Table, VersionReport],
) -> None:
    table, last = warm
    stage = turn(2, 1)
    late = rollout(90, policy_version=last.policy_version, stage=2)
    enter(table, stage)
    pending = table.send(late)
    table.accept(2)
    answer = pending.take() or table.send(late).take()
    assert isinstance(answer, Receipt)
    assert not answer.accepted
    assert "stale" in answer.reason
    fresh = learn(table, stage)
    assert late.name not in fresh.rollouts


@pytest.mark.parametrize("is_entered", [False, True], ids=["before-ledger", "after-ledger"])
def test_killed_at_the_start_of_a_round_it_goes_back_once(
    warm: tuple[Table, VersionReport], is_entered: bool
) -> None:
    table, last = warm
    stage = turn(2, 1)
    enter(table, stage)
    begun = table.report().message if not is_entered else table.accept(2)
    table.restart()
    again = table.accept(2)
    assert (again.policy_version, again.snapshot) == (begun.policy_version, begun.snapshot)
    enter(table, stage)
    assert table.versions.take() is None
    learned = learn(table, stage)
    assert learned.policy_version == begun.policy_version + 1
    table.restart()
    assert table.accept(2).snapshot == learned.snapshot
    enter(table, turn(8, 2))
    assert are_same(table.accept(8), last)


@pytest.mark.parametrize("harm", ["lost", "damaged"])
def test_without_the_end_of_phase_one_no_round_begins(
    warm: tuple[Table, VersionReport], harm: str
) -> None:
    table, _ = warm
    enter(table, turn(2, 1))
    table.accept(2)
    path = CheckpointStore(table.folder, "run-1", "antagonist", 3).warm_path
    if harm == "lost":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(CheckpointError, match=r"warm\.safetensors") as caught:
        enter(table, turn(8, 2))
    assert "\n" not in str(caught.value)


def test_the_same_round_of_the_same_seed_makes_the_same_bits(tmp_path: Path) -> None:
    made: list[str] = []
    for is_restarted in (False, True):
        table = Table(tmp_path / str(is_restarted))
        table.warm()
        learn(table, STAGE)
        stage = turn(2, 1)
        enter(table, stage)
        table.accept(2)
        if is_restarted:
            table.restart()
            table.accept(2)
            enter(table, stage)
        made.append(learn(table, stage).snapshot)
    assert made[0] == made[1]
