"""A recorded rollout under other names passes the learner's own checks."""

from pathlib import Path

import pytest

from benchmarks.scaling import recorded
from services.learner.gate import LEARN, check_contents, check_provenance
from shared.game.rules import RuleBook
from shared.messages.league import Lease, LeaseSummary, Stage
from shared.messages.training import Rollout

STAGE = Stage(
    index=3, phase="one", iteration=1, agent="antagonist", opponent="scripted:static",
    max_updates=9, score_weight=1.0, shaping_weight=0.4,
)  # fmt: skip
LEASE = Lease(lease="L000007", kind="train", stage=STAGE, seed=11)


@pytest.fixture(scope="module")
def rollout(tmp_path_factory: pytest.TempPathFactory) -> Rollout:
    path = tmp_path_factory.mktemp("rollout") / "rollout"
    recorded.record(path, num_envs=2)
    return recorded.read(path)


def test_it_is_learned_from_like_an_actors(rollout: Rollout, tmp_path: Path):
    made = recorded.under(
        rollout, LEASE, actor="a", boot="b" * 16, sequence=5, version=4, snapshot="c" * 64
    )
    summary = LeaseSummary(
        lease="L000007", actor="a", agent="antagonist", stage=3, opponent="scripted:static", seed=11
    )
    known = {"L000007": summary}
    assert check_provenance(made, "antagonist", STAGE, known, rollout.model) == LEARN
    assert check_contents(made, RuleBook().bout_steps) == LEARN
    assert (made.name, made.policy_version, made.rewards.shape) == ("b" * 16 + ":5", 4, (40, 2))
