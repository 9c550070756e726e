"""Phase two, serially: each round from the warm start, same seed same bits, stopped anywhere."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from services.jobs.runs import state_of
from services.learner.checkpoint import CheckpointStore
from shared.messages.training import AGENTS
from shared.policy.snapshot import unpack
from tests.integration.serial.running import RUN, Remains, assert_same, remains, run

PHASE_ONE = ("league.antagonist_updates=2", "league.protagonist_updates=2")
ROUNDS = (
    *PHASE_ONE,
    "league.rounds=2",
    "league.round_iterations=2",
    "league.round_antagonist_updates=2",
    "league.round_protagonist_updates=1",
)


@dataclasses.dataclass(frozen=True)
class Whole:
    """A run of both phases from start to end."""

    folder: Path
    ticks: int
    remains: Remains


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    folder: Path = tmp_path_factory.mktemp("whole")
    ticks = run(folder, overrides=ROUNDS)
    return Whole(folder, ticks, remains(folder))


def test_rounds_follow_phase_one_and_leave_a_library(whole: Whole) -> None:
    state = state_of(whole.folder)
    assert state.finished
    assert [r.stage.round for r in state.stages] == [0, 0, 1, 1, 1, 1, 2, 2, 2, 2]
    assert [r.updates for r in state.stages] == [2, 2, 2, 1, 2, 1, 2, 1, 2, 1]
    assert [r.restarts for r in state.stages] == [0, 0, 1, 1, 0, 0, 1, 1, 0, 0]
    assert state.repeated_rollouts == 0
    library = state.library()
    assert [number for number, _, _ in library] == [1, 2]
    assert len({ref for pair in library for ref in pair[1:]}) == 4
    for record in state.stages[2:]:
        assert (record.stage.score_weight, record.stage.shaping_weight) == (1.0, 0.0)
        rates = {v.metrics.learning_rate for v in record.versions if v.metrics is not None}
        assert rates == {3e-4}


def test_every_round_begins_with_the_policy_of_the_warm_start(whole: Whole) -> None:
    state = state_of(whole.folder)
    warm = dict(zip(AGENTS, state.warm_start() or (), strict=True))

    def weights(ref: str) -> list[NDArray[np.float32]]:
        digest = ref.removeprefix("sha256:")
        path = whole.folder / "snapshots" / f"{digest}.safetensors"
        found = unpack(path.read_bytes(), digest).weights
        return [
            found.obs_mean,
            found.obs_std,
            found.log_std,
            *(a for layer in found.layers for a in layer),
        ]

    for record in state.stages:
        if record.stage.start == "warm":
            begun, wanted = weights(record.versions[0].ref), weights(warm[record.stage.agent])
            assert all(np.array_equal(*pair) for pair in zip(begun, wanted, strict=True))
            end = weights(record.end_ref)
            assert not all(np.array_equal(*pair) for pair in zip(end, wanted, strict=True))


def test_the_warm_checkpoint_is_the_end_of_phase_one(whole: Whole) -> None:
    state = state_of(whole.folder)
    for agent in AGENTS:
        meta, _ = CheckpointStore(whole.folder / "learner" / agent, RUN, agent, 3).load_warm()
        assert meta.policy_version == state.stage_ends(agent, 0)[-1].end_version
        assert meta.round == 0


@pytest.mark.parametrize("draw", range(4))
def test_stopped_anywhere_in_phase_two_it_resumes_to_the_same_bits(
    tmp_path: Path, whole: Whole, draw: int
) -> None:
    generator = np.random.default_rng(draw)
    ticks = int(generator.integers(whole.ticks // 3, whole.ticks))
    run(tmp_path, ticks=ticks, overrides=ROUNDS)
    run(tmp_path, resume=True, overrides=ROUNDS)
    assert_same(remains(tmp_path), whole.remains)


def test_a_finished_phase_one_goes_on_to_the_same_rounds(tmp_path: Path) -> None:
    run(tmp_path, overrides=PHASE_ONE)
    before = state_of(tmp_path)
    assert before.finished
    assert before.library() == []
    run(tmp_path, resume=True, overrides=ROUNDS)
    after = state_of(tmp_path)
    assert after.finished
    assert after.ends == 2
    assert after.warm_start() == before.warm_start()
    assert len(after.library()) == 2
    assert run(tmp_path, resume=True, overrides=ROUNDS) == 0
