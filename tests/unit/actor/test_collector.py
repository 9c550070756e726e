import functools

import numpy as np
import pytest

from services.actor.collector import Collector, Segment, staggered_starts
from services.actor.evaluation import Evaluation
from shared.game.reward import RewardConfig
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import SnapshotPlayer, StaticPlayer
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from tests.unit.game.literal import (
    end_points,
    paper_points,
    point_to_segment,
    rotated_x,
    segment_to_segment,
)
from tests.unit.policy.making import weights

POLICY = GaussianPolicy(weights(seed=3))
WORLDS = 8
STEPS = 20
RULES = RuleBook(bout_steps=80, camping_steps=10)


@functools.cache
def model() -> FencingModel:
    """Two robots close to a target so large that there are points, penalties and camping."""
    return FencingModel.build(SimConfig(half_distance=0.8, target_radius=0.35))


def new_env() -> FencingEnv:
    return FencingEnv(model(), RULES, ActionConfig(), WORLDS)


def collector(env: FencingEnv, *, side: int = 0, seed: int = 7, opponent=None) -> Collector:
    return Collector(env, side, opponent or StaticPlayer(), STEPS, 1.0, 0.4, RewardConfig(), seed)


def look(env: FencingEnv, world: int) -> tuple[bool, bool, bool]:
    """In target, in contact, other in target: from the raw poses, by the slow geometry."""
    made = model()
    blades = []
    for sensors in env.batch.sensors[world].reshape(2, 20):
        grip = tuple(float(x) for x in sensors[:3])
        direction = rotated_x(tuple(float(x) for x in sensors[3:7]))
        blades.append(end_points(grip, direction, made.bat_back, made.bat_front))
    centre = tuple(float(x) for x in made.target_centre)
    reach = made.bat_radius + made.target_radius
    inside = [point_to_segment(centre, *blade) <= reach for blade in blades]
    contact = segment_to_segment(*blades) <= 2 * made.bat_radius
    return inside[0], contact, inside[1]


def same(one: Segment, other: Segment) -> bool:
    names = ("obs", "last_obs", "actions", "means", "log_probs", "rewards", "bouts", "truncated")
    return all(getattr(one, n).tobytes() == getattr(other, n).tobytes() for n in names)


def test_bouts_start_spread_over_the_bout_in_whole_rollouts():
    starts = staggered_starts(WORLDS, RULES.bout_steps, STEPS)
    assert starts.tolist() == [0, 0, 20, 20, 40, 40, 60, 60]


def test_the_first_bouts_of_late_starters_are_incomplete_and_all_later_ones_complete():
    worlds = collector(new_env())
    seen: dict[int, bool] = {}
    for _ in range(8):
        results = worlds.collect(POLICY).results
        assert results is not None
        seen |= dict(zip(results.bouts.tolist(), results.complete.tolist(), strict=True))
    assert len(seen) == 16
    assert {bout for bout, complete in seen.items() if not complete} == {2, 3, 4, 5, 6, 7}


def test_a_bout_never_straddles_two_rollouts():
    worlds = collector(new_env())
    before = None
    for _ in range(9):
        segment = worlds.collect(POLICY)
        assert (segment.first_step % STEPS == 0).all()
        assert (segment.truncated == (segment.first_step + STEPS == RULES.bout_steps)).all()
        if before is not None:
            assert ((segment.bouts != before.bouts) == before.truncated).all()
            assert (segment.first_step[before.truncated] == 0).all()
        before = segment


def test_actions_are_the_policys_on_what_was_seen():
    segment = collector(new_env(), side=1).collect(POLICY)
    flat = segment.obs.reshape(-1, segment.obs.shape[-1])
    np.testing.assert_allclose(
        segment.means.reshape(flat.shape[0], -1), POLICY.mean(flat), atol=1e-6
    )
    deviation = (segment.actions - segment.means) / POLICY.std
    by_hand = -0.5 * (deviation**2 + np.log(2 * np.pi)).sum(-1) - np.log(POLICY.std).sum()
    np.testing.assert_allclose(segment.log_probs, by_hand, atol=1e-4)


def test_the_last_observation_is_the_true_end_and_the_next_rollout_goes_on_from_it():
    worlds = collector(new_env())
    first, second = worlds.collect(POLICY), worlds.collect(POLICY)
    going = ~first.truncated
    assert going.any()
    assert not going.all()
    assert (second.obs[0][going] == first.last_obs[going]).all()
    assert (second.obs[0][~going] != first.last_obs[~going]).any()


@pytest.mark.parametrize("side", [0, 1])
def test_results_equal_a_recount_by_the_papers_algorithm_from_the_poses(side: int):
    """Play the same actions again in other worlds, look at the bats, and count by hand."""
    worlds = collector(new_env(), side=side)
    segments = [worlds.collect(POLICY) for _ in range(8)]
    again = new_env()
    generator = np.random.default_rng(7)
    starts = staggered_starts(WORLDS, RULES.bout_steps, STEPS)
    again.reset(np.arange(WORLDS), generator, starts)
    seen: dict[int, list[tuple[bool, bool, bool]]] = {}
    scores: dict[int, tuple[float, int, int]] = {}
    static = np.zeros((WORLDS, 6), np.float32)
    for segment in segments:
        generator.standard_normal(segment.actions.shape, np.float32)
        for actions in segment.actions:
            again.step(*((actions, static) if side == 0 else (static, actions)))
            for world, bout in enumerate(segment.bouts.tolist()):
                seen.setdefault(bout, []).append(look(again, world))
        assert segment.results is not None
        for bout, score, attack, penalty in zip(
            segment.results.bouts.tolist(),
            segment.results.score.tolist(),
            segment.results.attack_steps.tolist(),
            segment.results.penalty_steps.tolist(),
            strict=True,
        ):
            scores[bout] = (score, attack, penalty)
        again.reset(np.flatnonzero(segment.truncated), generator)
    for bout, found in scores.items():
        points = paper_points(seen[bout], RULES.camping_steps)
        penalties = sum(inside and touching for inside, touching, _ in seen[bout])
        attacks = sum(inside and not touching for inside, touching, _ in seen[bout])
        assert found == (sum(points), attacks, penalties), bout
    assert len({score for score, _, _ in scores.values()}) > 3  # the game was played at all
    camped = sum(int(s.results.camping_steps.sum()) for s in segments if s.results)
    assert camped > 0


def test_the_same_seed_plays_the_same_and_another_does_not():
    one, other, third = (collector(new_env(), seed=seed) for seed in (1, 1, 2))
    first, second, last = (c.collect(POLICY) for c in (one, other, third))
    assert same(first, second)
    assert not same(first, last)


def test_what_was_played_before_in_the_same_worlds_is_forgotten():
    env = new_env()
    collector(env, seed=5).collect(POLICY)
    assert same(
        collector(env, seed=1).collect(POLICY), collector(new_env(), seed=1).collect(POLICY)
    )


def test_a_collector_continues_bit_for_bit_in_other_worlds():
    opponent = SnapshotPlayer(GaussianPolicy(weights(seed=9)), stochastic=True)
    one = collector(new_env(), opponent=opponent)
    for _ in range(3):
        one.collect(POLICY)
    arrays, values = one.state()
    arrays = {name: value.copy() for name, value in arrays.items()}
    other = collector(new_env(), opponent=opponent, seed=99)
    other.collect(POLICY)
    other.restore(arrays, values)
    for _ in range(5):
        mine, its = one.collect(POLICY), other.collect(POLICY)
        assert same(mine, its)
        assert mine.results is not None
        assert its.results is not None
        assert mine.results.score.tobytes() == its.results.score.tobytes()


def test_an_evaluation_ends_with_its_bouts_whole_and_no_others():
    players = (SnapshotPlayer(POLICY, stochastic=False), StaticPlayer())
    evaluation = Evaluation(new_env(), players, 5, seed=1)
    results = [evaluation.advance(30) for _ in range(3)]
    assert results[:2] == [None, None]
    assert results[2] is not None
    assert results[2].bouts.tolist() == [0, 1, 2, 3, 4]
    assert results[2].complete.all()
    again = Evaluation(new_env(), players, 5, seed=1).advance(80)
    assert again is not None
    assert again.score.tobytes() == results[2].score.tobytes()


@pytest.mark.parametrize("bouts", [0, WORLDS + 1])
def test_an_evaluation_has_a_world_for_every_bout(bouts: int):
    with pytest.raises(ValueError, match=f"bouts \\({bouts}\\) must be in 1..8"):
        Evaluation(new_env(), (StaticPlayer(), StaticPlayer()), bouts, seed=1)
