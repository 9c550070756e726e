"""An actor with real physics on a memory bus, with league and learners played by hand."""

import itertools
from typing import Any

import msgspec
import numpy as np
import pytest

from services.actor.evaluation import Evaluation
from services.actor.service import MOST_UNPLAYABLE_SECONDS, UNPLAYABLE_SECONDS, Actor
from services.learner.gate import Decision, check_contents
from shared.game.reward import RewardConfig
from shared.messages.league import Lease, LeaseStatus
from shared.messages.training import Receipt
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import StaticPlayer
from tests.unit.actor.driving import (
    BOUT_STEPS,
    CONFIG,
    RULES,
    STAGE,
    STEPS,
    TRAIN,
    WORLDS,
    Hall,
    fit,
    model,
    policy,
    worlds,
)
from tests.unit.actor.recount import recounted, recounted_evaluation


@pytest.fixture
def hall() -> Hall:
    return Hall()


def waiting(hall: Hall) -> str:
    return hall.actor.health().waiting_for


# -- leases ------------------------------------------------------------------------------------


def test_without_work_it_says_why_and_asks_again_after_a_while(hall: Hall):
    hall.tick(5)
    assert len(hall.requests) == 1
    assert waiting(hall) == "league: nothing to do"
    hall.clock.advance(0.25)
    hall.tick(5)
    assert len(hall.requests) == 2


def test_a_league_that_does_not_answer_is_asked_again(hall: Hall):
    hall.league.close()
    hall.tick(2)
    assert "nobody answers" in waiting(hall)
    assert hall.actor.health().state == "without a lease"


def test_a_lease_waits_for_the_first_policy_of_its_learner(hall: Hall):
    hall.offer = TRAIN
    hall.tick(5)
    assert waiting(hall) == "learner antagonist: its first policy"
    hall.announce(policy())
    hall.tick(2)
    assert len(hall.arrived) == 1
    assert waiting(hall) == ""


def test_a_lease_is_renewed_after_a_third_of_its_time_and_follows_the_window(hall: Hall):
    hall.renewal = LeaseStatus(alive=True, expires_in=9.0, window=6)
    hall.train()
    assert len(hall.arrived) == 4
    hall.clock.advance(2.9)
    hall.tick(3)
    assert hall.renewed == []
    hall.clock.advance(0.2)
    hall.tick(5)
    assert len(hall.renewed) == 1
    assert len(hall.arrived) == 6
    for _ in range(4):
        hall.clock.advance(3.1)
        hall.tick(3)
    assert len(hall.renewed) == 5
    assert len(hall.requests) == 1


def test_a_lease_that_cannot_be_renewed_lapses_and_nothing_is_played_under_it_any_more(
    hall: Hall,
):
    hall.renewal = None
    hall.train()
    hall.acknowledge()
    hall.offer = Lease(lease="", kind="none", reason="no stage")
    hall.clock.advance(9.1)
    hall.tick(10)
    assert waiting(hall) == "league: no stage"
    assert hall.arrived == []
    assert len(hall.requests) == 2


def test_a_lease_that_the_league_has_ended_is_dropped_at_the_renewal(hall: Hall):
    hall.renewal = LeaseStatus(alive=False)
    hall.train()
    hall.acknowledge()
    hall.offer = msgspec.structs.replace(TRAIN, lease="L000002", seed=6)
    hall.clock.advance(3.1)
    rollouts = hall.rollouts(8)
    assert {rollout.lease for rollout in rollouts[-4:]} == {"L000002"}
    assert rollouts[-1].seed == 6


def test_a_stage_that_is_over_is_left_as_soon_as_the_schedule_says_so(hall: Hall):
    hall.train()
    hall.acknowledge()
    hall.offer = Lease(lease="", kind="none", reason="between stages")
    hall.schedule(msgspec.structs.replace(STAGE, index=1, agent="protagonist"))
    hall.tick(5)
    assert hall.arrived == []
    assert waiting(hall) == "league: between stages"


def test_an_old_schedule_ends_nothing(hall: Hall):
    hall.train(stage=msgspec.structs.replace(STAGE, index=3))
    hall.schedule(msgspec.structs.replace(STAGE, index=2))
    hall.tick(3)
    assert len(hall.requests) == 1


# -- rollouts ----------------------------------------------------------------------------------


def test_a_rollout_says_where_it_comes_from(hall: Hall):
    opponent = hall.store(policy(seed=9))
    stage = msgspec.structs.replace(STAGE, index=2, opponent=opponent)
    hall.train(stage=stage)
    made = policy()
    first, second, *_ = hall.rollouts(4)
    assert (first.agent, first.actor, first.boot) == ("antagonist", "actor-0", hall.bus.boot)
    assert (first.sequence, second.sequence) == (0, 1)
    assert (first.lease, first.stage, first.seed) == ("L000001", 2, 5)
    assert (first.policy_version, first.snapshot) == (0, made.digest)
    assert (first.opponent, first.model) == (opponent, model().hash)
    assert first.obs.shape == (STEPS, WORLDS, 27)
    assert hall.fetched == [opponent]


def test_the_actions_are_drawn_from_the_policy_named_and_pass_the_learners_gate(hall: Hall):
    hall.train()
    acting = GaussianPolicy(policy().weights)
    for rollout in hall.rollouts(6):
        for step in range(STEPS):
            np.testing.assert_array_equal(rollout.means[step], acting.mean(rollout.obs[step]))
        np.testing.assert_array_equal(rollout.stds, acting.std)
        ruling = check_contents(rollout, BOUT_STEPS)
        assert ruling.decision is Decision.LEARN, ruling.reason
        noise = (rollout.actions - rollout.means) / rollout.stds
        assert abs(float(noise.mean())) < 0.1
        assert abs(float(noise.std()) - 1.0) < 0.1


def test_bouts_start_staggered_and_end_only_with_a_rollout(hall: Hall):
    hall.train()
    rollouts = hall.rollouts(5)
    assert rollouts[0].first_step.tolist() == [0, 0, 20, 20, 40, 40, 60, 60]
    assert rollouts[0].truncated.tolist() == [False] * 6 + [True] * 2
    assert rollouts[1].bouts.tolist() == [0, 1, 2, 3, 4, 5, 8, 9]
    for one, following in itertools.pairwise(rollouts):
        expected = np.where(one.truncated, 0, one.first_step + STEPS)
        assert following.first_step.tolist() == expected.tolist()
        goes_on = ~one.truncated
        np.testing.assert_array_equal(following.obs[0][goes_on], one.last_obs[goes_on])
        # The last observation of a bout is its true end, not the start of the next.
        assert (one.last_obs[one.truncated][:, 26] == np.float32(BOUT_STEPS * 0.01)).all()


@pytest.mark.parametrize("agent", ["antagonist", "protagonist"])
def test_scores_and_rewards_equal_an_independent_recount_of_the_observations(
    hall: Hall, agent: Any
):
    hall.offer = msgspec.structs.replace(TRAIN, stage=msgspec.structs.replace(STAGE, agent=agent))
    hall.announce(policy(agent=agent), agent)
    rollouts = hall.rollouts(9)
    hall.hear_results()
    own = policy(agent=agent).reference
    sign = 1.0 if agent == "antagonist" else -1.0
    played, points = recounted(rollouts, model(), RULES)
    for rollout, expected in zip(rollouts, points, strict=True):
        np.testing.assert_allclose(rollout.rewards, sign * 0.1 * expected, atol=1e-6)
    assert any(np.ptp(expected) for expected in points)
    told = 0
    for results in hall.results:
        assert (results.kind, results.stage, results.lease) == ("train", 0, "L000001")
        pair = (results.antagonist, results.protagonist)
        assert pair == ((own, "scripted:static") if sign > 0 else ("scripted:static", own))
        for index, bout in enumerate(results.bouts.tolist()):
            if bout not in played.ended:
                continue
            told += 1
            tally = played.bouts[bout]
            assert results.score[index] == tally.score
            assert results.attack_steps[index] == tally.attack_steps
            assert results.penalty_steps[index] == tally.penalty_steps
            assert results.camping_steps[index] == tally.camping_steps
            assert results.complete[index] == (tally.steps == BOUT_STEPS)
    assert told == len(played.ended) == 18


def test_it_plays_no_more_than_its_window_until_it_is_answered(hall: Hall):
    hall.train(window=2)
    assert len(hall.arrived) == 2
    assert waiting(hall) == "learner antagonist: 2 rollouts unacknowledged"
    hall.arrived.pop(0)[1].reply(Receipt(accepted=True))
    hall.tick(5)
    assert [rollout.sequence for rollout, _ in hall.arrived] == [1, 2]
    assert hall.actor.health().counters["rollouts_acknowledged"] == 1


def test_what_is_too_long_for_one_message_goes_out_in_parts_each_of_some_worlds(
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.setattr("services.actor.service.parts_of", lambda steps, worlds: 3)
    hall = Hall()
    hall.train()
    rollouts = [rollout for rollout, _ in hall.arrived]
    assert [rollout.sequence for rollout in rollouts] == list(range(12))  # a window of 4, 3 each
    assert [len(rollout.bouts) for rollout in rollouts] == [3, 2, 3] * 4
    assert {rollout.worlds for rollout in rollouts} == {WORLDS}
    for rollout in rollouts:
        assert check_contents(rollout, BOUT_STEPS).decision is Decision.LEARN
    bouts = np.concatenate([rollout.bouts for rollout in rollouts[:3]])
    np.testing.assert_array_equal(bouts, np.arange(WORLDS))
    (first, request), *_ = hall.arrived
    request.reply(Receipt(accepted=True))
    hall.tick(3)
    assert len(hall.arrived) == 12, first.name  # two parts under way leave no room for three


def test_a_dropped_rollout_is_counted_and_play_goes_on(hall: Hall):
    hall.train(window=1)
    hall.acknowledge(accepted=False, reason="stale: version 0, now 4, oldest 3")
    hall.tick(3)
    counters = hall.actor.health().counters
    assert (counters["rollouts_dropped"], counters["rollouts_acknowledged"]) == (1, 0)
    assert len(hall.arrived) == 1


def test_an_unanswered_rollout_is_sent_again_unchanged_even_when_its_lease_is_over(hall: Hall):
    hall.train(window=1)
    ((first, _),) = hall.arrived
    hall.arrived = []
    hall.offer = Lease(lease="", kind="none", reason="over")
    hall.schedule(None)
    hall.clock.advance(CONFIG.acknowledge_timeout + 0.1)
    hall.tick(2)
    hall.clock.advance(0.3)
    hall.tick(2)
    ((again, _),) = hall.arrived
    assert again.name == first.name
    np.testing.assert_array_equal(again.actions, first.actions)
    hall.acknowledge()
    hall.tick(2)
    assert hall.actor.health().counters["rollouts_acknowledged"] == 1


def test_a_new_policy_acts_from_the_next_rollout_on(hall: Hall):
    hall.train(window=1)
    hall.announce(policy(seed=1, version=7))
    rollouts = hall.rollouts(2)
    assert [rollout.policy_version for rollout in rollouts] == [0, 7]
    assert rollouts[1].snapshot == policy(seed=1, version=7).digest


# -- what does not fit -------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"model": "x" * 64}, "model"),
        ({"control_timestep": 0.02}, "control_timestep"),
        ({"offset_bound_m": 0.05}, "offset_bound_m"),
        ({"observation_schema": "0" * 16}, "observation_schema"),
    ],
)
def test_an_announced_policy_that_does_not_fit_is_said_and_the_one_before_plays_on(
    hall: Hall, changes: dict[str, Any], field: str
):
    hall.train(window=1)
    hall.announce(policy(seed=1, version=1, **changes))
    rollouts = hall.rollouts(3)
    assert {rollout.policy_version for rollout in rollouts} == {0}
    assert f"its {field} is" in hall.actor.health().last_error


def test_an_opponent_that_does_not_fit_makes_the_lease_unplayable(hall: Hall):
    opponent = hall.store(policy(seed=9, model="x" * 64))
    hall.train(stage=msgspec.structs.replace(STAGE, opponent=opponent))
    assert hall.arrived == []
    assert len(hall.requests) == 1
    assert "does not fit here: its model is xxx" in hall.actor.health().last_error
    hall.clock.advance(UNPLAYABLE_SECONDS + 0.1)
    hall.offer = TRAIN
    hall.tick(4)
    assert len(hall.requests) == 2
    assert len(hall.arrived) > 0


def test_an_actor_that_can_play_nothing_asks_less_and_less_often(hall: Hall):
    """Each lease that it cannot play is two rows of the ledger."""
    opponent = hall.store(policy(seed=9, model="x" * 64))
    hall.train(stage=msgspec.structs.replace(STAGE, opponent=opponent))
    for _ in range(200):
        hall.clock.advance(UNPLAYABLE_SECONDS)
        hall.tick(4)
    assert 5 <= len(hall.requests) <= 12
    hall.offer = TRAIN
    hall.clock.advance(MOST_UNPLAYABLE_SECONDS + 0.1)
    hall.tick(4)
    assert len(hall.arrived) > 0


def test_an_opponent_that_arrives_damaged_makes_the_lease_unplayable(hall: Hall):
    opponent = hall.store(policy(seed=9))
    hall.stored[opponent] = policy(seed=8).payload
    hall.train(stage=msgspec.structs.replace(STAGE, opponent=opponent))
    assert hall.arrived == []
    assert "snapshot is damaged: its hash is" in hall.actor.health().last_error


def test_an_opponent_that_the_league_lacks_is_asked_for_again(hall: Hall):
    made = policy(seed=9)
    hall.train(stage=msgspec.structs.replace(STAGE, opponent=made.reference))
    assert len(hall.fetched) == 1
    assert "it was never reported here" in waiting(hall)
    hall.store(made)
    hall.clock.advance(0.6)
    hall.tick(5)
    assert len(hall.fetched) == 2
    assert len(hall.arrived) > 0


def test_an_unknown_scripted_opponent_makes_the_lease_unplayable(hall: Hall):
    hall.train(stage=msgspec.structs.replace(STAGE, opponent="scripted:ghost"))
    assert "there is no player 'scripted:ghost'" in hall.actor.health().last_error


def test_opponents_are_fetched_once_and_the_least_used_leaves(hall: Hall):
    references = [hall.store(policy(seed=seed)) for seed in (1, 2, 3)]

    def meet(reference: str, number: int) -> None:
        hall.offer = TRAIN
        hall.train(lease=f"L{number:06d}", stage=msgspec.structs.replace(STAGE, opponent=reference))
        assert hall.acknowledge()[-1].opponent == reference
        hall.offer = Lease(lease="", kind="none")
        hall.schedule(None)
        hall.tick(3)
        hall.schedule(STAGE)
        hall.clock.advance(0.3)

    for number, which in enumerate((0, 1, 0, 2, 0, 1)):
        meet(references[which], number)
    assert hall.fetched == [references[i] for i in (0, 1, 2, 1)]
    assert hall.actor.health().counters["opponents_cached"] == 2


def test_a_rollout_length_that_does_not_divide_the_bout_is_refused():
    hall = Hall()
    cfg = msgspec.structs.replace(CONFIG, rollout_steps=30)
    with pytest.raises(ValueError, match=r"rollout_steps \(30\) must divide the bout's 80 steps"):
        Actor(cfg, RewardConfig(), worlds(), fit(), hall.bus, hall.clock)


# -- evaluation --------------------------------------------------------------------------------


def evaluation(hall: Hall, **changes: Any) -> Lease:
    antagonist, protagonist = hall.store(policy(seed=1)), hall.store(policy(seed=2))
    plain = Lease(
        lease="L000009", kind="evaluate", antagonist=antagonist, protagonist=protagonist,
        bouts=5, stochastic=False, seed=21, expires_in=9.0,
    )  # fmt: skip
    return msgspec.structs.replace(plain, **changes)


def test_an_evaluation_plays_its_bouts_from_start_to_end_and_equals_a_recount(hall: Hall):
    hall.offer = evaluation(hall)
    hall.tick(4)
    hall.offer = Lease(lease="", kind="none", reason="over")
    hall.tick(10)
    (results,) = hall.results
    assert (results.kind, results.stage, results.seed) == ("evaluate", -1, 21)
    assert (results.antagonist, results.protagonist) == tuple(hall.stored)
    assert results.bouts.tolist() == [0, 1, 2, 3, 4]
    assert results.complete.all()
    players = [GaussianPolicy(policy(seed=seed).weights) for seed in (1, 2)]
    tallies = recounted_evaluation(worlds(), players, seed=21)[:5]
    assert results.score.tolist() == [tally.score for tally in tallies]
    assert results.camping_steps.tolist() == [tally.camping_steps for tally in tallies]
    assert results.penalty_steps.tolist() == [tally.penalty_steps for tally in tallies]
    assert any(tally.score for tally in tallies)
    assert waiting(hall) == "league: over"


def test_an_evaluation_of_few_bouts_steps_no_more_worlds_than_it_has_bouts(hall: Hall):
    bouts = WORLDS // 4
    hall.offer = evaluation(hall, bouts=bouts)
    hall.tick(4)
    hall.offer = Lease(lease="", kind="none", reason="over")
    hall.tick(10)
    (results,) = hall.results
    assert results.bouts.tolist() == list(range(bouts))
    players = [GaussianPolicy(policy(seed=seed).weights) for seed in (1, 2)]
    tallies = recounted_evaluation(worlds(bouts), players, seed=21)
    assert results.score.tolist() == [tally.score for tally in tallies]
    assert hall.actor.health().counters["steps"] == bouts * RULES.bout_steps


def test_viewers_see_the_worlds_in_which_an_evaluation_of_few_bouts_is_played():
    hall = Hall(msgspec.structs.replace(CONFIG, frame_period=2.0, frame_steps=4))
    hall.offer = evaluation(hall, bouts=1)
    hall.tick(4)
    hall.offer = Lease(lease="", kind="none", reason="over")
    hall.tick(10)
    (results,) = hall.results
    shown = [frames for frames in iter(hall.frames.take, None) if frames is not None]
    assert shown
    assert shown[-1].steps[-1] == RULES.bout_steps
    assert shown[-1].score[-1] == results.score[0]


def test_evaluations_of_one_seed_are_the_same_bouts_and_of_another_are_not(hall: Hall):
    for number, seed in enumerate((4, 4, 5)):
        hall.offer = evaluation(hall, lease=f"L{number:06d}", seed=seed, stochastic=True)
        while len(hall.results) == number:
            hall.tick()
            hall.clock.advance(0.05)
        hall.offer = Lease(lease="", kind="none")
        hall.tick(3)
        hall.clock.advance(0.3)
    first, same, other = (results.attack_steps.tolist() for results in hall.results)
    assert first == same
    assert first != other


def test_an_evaluation_that_ends_before_it_is_done_reports_nothing(hall: Hall):
    hall.renewal = LeaseStatus(alive=False)
    hall.offer = evaluation(hall)
    hall.tick(4)
    hall.offer = Lease(lease="", kind="none")
    hall.clock.advance(3.1)
    hall.tick(20)
    assert hall.results == []


def test_more_bouts_than_worlds_are_refused():
    players = (StaticPlayer(), StaticPlayer())
    with pytest.raises(ValueError, match=r"bouts \(9\) must be in 1\.\.8"):
        Evaluation(worlds(), players, 9, seed=0)


# -- serial mode -------------------------------------------------------------------------------


def test_an_actor_restored_from_its_state_plays_on_bit_for_bit():
    opponent = policy(seed=9)
    halls = [Hall(), Hall()]
    for hall in halls:
        hall.store(opponent)
        hall.offer = msgspec.structs.replace(
            TRAIN, window=1, stage=msgspec.structs.replace(STAGE, opponent=opponent.reference)
        )
        hall.announce(policy())
    whole, resumed = halls
    whole.rollouts(5)
    whole.actor.paused = True
    whole.tick()
    whole.acknowledge()
    whole.tick(2)
    assert whole.actor.quiet
    arrays, values = whole.actor.state()
    resumed.actor.restore({k: v.copy() for k, v in arrays.items()}, _through_json(values))
    resumed.actor.paused = True
    while not resumed.actor.ready:
        resumed.tick()
    whole.actor.paused = resumed.actor.paused = False
    assert resumed.requests == []
    continued = [hall.rollouts(6) for hall in halls]
    for one, other in zip(*continued, strict=True):
        assert one.sequence == other.sequence
        for field in ("bouts", "first_step", "obs", "last_obs", "actions", "rewards", "log_probs"):
            np.testing.assert_array_equal(getattr(one, field), getattr(other, field), err_msg=field)
    for hall in halls:
        hall.hear_results()
    tail = [[r.score.tolist() for r in hall.results][-len(resumed.results) :] for hall in halls]
    assert tail[0] == tail[1]
    assert resumed.results


def _through_json(values: dict[str, Any]) -> dict[str, Any]:
    return msgspec.json.decode(msgspec.json.encode(values))


def test_a_paused_actor_keeps_its_lease_and_plays_nothing(hall: Hall):
    hall.train(window=1)
    hall.acknowledge()
    hall.actor.paused = True
    hall.clock.advance(3.1)
    hall.tick(5)
    assert hall.arrived == []
    assert len(hall.renewed) == 1
    hall.actor.paused = False
    hall.tick()
    assert len(hall.arrived) == 1


# -- what viewers see --------------------------------------------------------------------------


def test_a_bout_is_shown_from_its_first_step_to_its_last_and_then_there_is_a_pause():
    hall = Hall(msgspec.structs.replace(CONFIG, frame_period=2.0, frame_steps=4))
    hall.offer = TRAIN
    hall.announce(policy())
    hall.rollouts(8)
    shown = []
    while (frames := hall.frames.take()) is not None:
        shown.append(frames)
    steps = [step for frames in shown for step in frames.steps.tolist()]
    assert steps == list(range(4, BOUT_STEPS + 1, 4))
    assert {frames.bout for frames in shown} == {0}
    assert {frames.antagonist for frames in shown} == {policy().reference}
    for frames in shown:
        count = len(frames.steps)
        assert frames.positions.shape == (count, len(model().body_names), 3)
        assert frames.in_target.shape == (count, 2)
    hall.hear_results()
    told = next(r for r in hall.results if 0 in r.bouts.tolist())
    assert shown[-1].score[-1] == told.score[told.bouts.tolist().index(0)]
    hall.clock.advance(2.1)
    hall.rollouts(8)
    assert hall.frames.take() is not None
