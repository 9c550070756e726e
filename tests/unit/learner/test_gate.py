"""What a learner takes, and why it drops the rest."""

import itertools
from collections.abc import Iterator
from typing import Any

import msgspec
import numpy as np
import pytest

from services.learner.gate import (
    Decision,
    check_contents,
    check_new,
    check_provenance,
    check_version,
)
from services.learner.played import KEPT_BOUTS, Played
from shared.messages.league import LeaseSummary, Stage
from shared.messages.training import Rollout
from tests.unit.learner.making import BOUT_STEPS, MODEL, rollout

STAGE = Stage(
    index=0,
    phase="one",
    iteration=1,
    agent="antagonist",
    opponent="scripted:static",
    max_updates=3,
    score_weight=1.0,
    shaping_weight=1.0,
)
LEASE = LeaseSummary(
    lease="L000001",
    actor="actor-0",
    agent="antagonist",
    stage=0,
    opponent="scripted:static",
    seed=11,
)
LEASES = {LEASE.lease: LEASE}


def test_a_rollout_from_a_lease_of_this_stage_is_learned_from():
    ruling = check_provenance(rollout(), "antagonist", STAGE, LEASES, MODEL)
    assert ruling.decision is Decision.LEARN


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"agent": "protagonist"}, "it is for the protagonist, this learner is the antagonist's"),
        ({"model": "x" * 64}, "model xxxxxxxxxxxx is not this run's mmmmmmmmmmmm"),
        ({"opponent": "sha256:" + "b" * 64}, "mixed opponents: sha256:b"),
        ({"actor": "actor-1"}, "wrong actor: actor-1 in the rollout, actor-0 in lease L000001"),
        ({"seed": 12}, "wrong seed: 12 in the rollout, 11 in lease L000001"),
        ({"stage": -1}, "stage -1 is over"),
        ({"sequence": -1, "draw": 0}, "sequence -1 is no count"),
    ],
)
def test_a_rollout_from_elsewhere_is_dropped_with_the_reason(changes: Any, reason: str):
    ruling = check_provenance(rollout(**changes), "antagonist", STAGE, LEASES, MODEL)
    assert ruling.decision is Decision.DROP
    assert reason in ruling.reason


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"lease": "L000009"}, "unknown bout: lease L000009 is not known here yet"),
        ({"stage": 1}, "stage 1 is not known here yet"),
    ],
)
def test_what_the_schedule_may_yet_say_is_asked_again(changes: Any, reason: str):
    ruling = check_provenance(rollout(**changes), "antagonist", STAGE, LEASES, MODEL)
    assert ruling.decision is Decision.LATER
    assert reason in ruling.reason


def test_a_boot_that_the_lease_is_not_of_or_that_swells_every_record_is_dropped():
    lease = msgspec.structs.replace(LEASE, boot="b0")
    known = {lease.lease: lease}
    assert check_provenance(rollout(), "antagonist", STAGE, known, MODEL).decision is Decision.LEARN
    for leases, boot, reason in (
        (known, "b1", "wrong boot: lease L000001 is of another process of actor-0"),
        (LEASES, "b" * 16_000, "boot has 16000 characters"),
    ):
        theirs = rollout(boot=boot)
        ruling = check_provenance(theirs, "antagonist", STAGE, leases, MODEL)
        assert (ruling.decision, ruling.is_fault) == (Decision.DROP, True)
        assert reason in ruling.reason


def test_a_sequence_that_no_record_can_hold_is_dropped():
    theirs = msgspec.structs.replace(rollout(), sequence=2**63)
    ruling = check_provenance(theirs, "antagonist", STAGE, LEASES, MODEL)
    assert (ruling.decision, ruling.is_fault) == (Decision.DROP, True)


def test_a_rollout_of_the_other_learners_stage_is_over():
    theirs = msgspec.structs.replace(STAGE, agent="protagonist")
    ruling = check_provenance(rollout(), "antagonist", theirs, LEASES, MODEL)
    assert (ruling.decision, ruling.reason) == (Decision.DROP, "stage 0 is over")


def test_between_stages_nothing_old_is_taken_and_what_is_new_may_come_again():
    assert check_provenance(rollout(), "antagonist", None, {}, MODEL).decision is Decision.LATER
    old = check_provenance(rollout(stage=-1), "antagonist", None, {}, MODEL)
    assert old.decision is Decision.DROP


@pytest.mark.parametrize(
    ("version", "decision"),
    [(2, Decision.DROP), (3, Decision.LEARN), (4, Decision.LEARN), (5, Decision.LATER)],
)
def test_versions_from_the_oldest_to_the_current_are_taken(version: int, decision: Decision):
    ruling = check_version(rollout(policy_version=version), current=4, oldest=3)
    assert ruling.decision is decision
    if decision is Decision.DROP:
        assert ruling.reason == "stale: version 2, now 4, oldest 3"


def test_a_consistent_rollout_is_learned_from():
    assert check_contents(rollout(), BOUT_STEPS).decision is Decision.LEARN
    # A bout's last rollout too.
    assert rollout(worlds=10).truncated.any()
    assert check_contents(rollout(worlds=10), BOUT_STEPS).decision is Decision.LEARN


def changed(field: str, at: Any, value: Any) -> dict[str, Any]:
    array = getattr(rollout(), field).copy()
    array[at] = value
    return {field: array}


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        (changed("bouts", 1, 0), "a bout stands in two worlds"),
        (changed("bouts", 1, -4), "negative number"),
        (changed("first_step", 0, -8), "runs outside its 80 steps"),
        (changed("first_step", 0, 79), "runs outside its 80 steps"),
        (changed("first_step", 0, np.iinfo(np.int32).max), "runs outside its 80 steps"),
        (changed("truncated", 0, True), "truncated does not say"),
        (changed("stds", 0, 0.0), "standard deviations are outside"),
        (changed("stds", 0, -1.0), "standard deviations are outside"),
        (changed("stds", 0, 1e9), "standard deviations are outside"),
        (changed("log_probs", (3, 3), -1.0), "log probabilities are not those of the actions"),
        (changed("actions", (3, 3, 0), 9.0), "log probabilities are not those of the actions"),
        (changed("means", (3, 3, 0), 9.0), "log probabilities are not those of the actions"),
        (changed("actions", (3, 3, 0), 3e38), "actions has a value beyond"),
        (changed("rewards", (3, 3), -1e7), "rewards has a value beyond"),
        (changed("obs", (3, 3, 3), 1e30), "obs has a value beyond"),
    ],
)
def test_a_rollout_that_contradicts_itself_is_dropped_with_the_reason(changes: Any, reason: str):
    ruling = check_contents(rollout(**changes), BOUT_STEPS)
    assert ruling.decision is Decision.DROP
    assert reason in ruling.reason


def test_an_empty_rollout_is_dropped():
    for changes in ({"worlds": 0}, {"steps": 0}):
        sample = rollout(**{"steps": 8, "worlds": 8})
        keep = slice(0, 0)
        if "steps" in changes:
            cut = {
                name: getattr(sample, name)[keep]
                for name in ("obs", "actions", "means", "log_probs", "rewards")
            }
        else:
            cut = {
                name: getattr(sample, name)[:, keep]
                for name in ("obs", "actions", "means", "log_probs", "rewards")
            } | {
                name: getattr(sample, name)[keep]
                for name in ("bouts", "first_step", "last_obs", "truncated")
            }
        ruling = check_contents(msgspec.structs.replace(sample, **cut), BOUT_STEPS)
        assert ruling.decision is Decision.DROP
        assert ruling.reason.startswith("empty")


def test_rounding_of_honest_log_probabilities_is_forgiven():
    for seed in range(20):
        sample = rollout(seed, worlds=64, policy=None)
        assert check_contents(sample, BOUT_STEPS).decision is Decision.LEARN


def played(rollouts: int, worlds: int, steps: int = 8) -> Iterator[Rollout]:
    """The rollouts of a lease: bouts begin staggered, and follow each other in every world."""
    plain = rollout(worlds=worlds, steps=steps)
    first = np.arange(worlds) * (BOUT_STEPS // steps) // worlds * steps
    bouts, following = np.arange(worlds), worlds
    for _ in range(rollouts):
        yield msgspec.structs.replace(plain, bouts=bouts.copy(), first_step=first.astype(np.int32))
        first = first + steps
        for world in np.flatnonzero(first == BOUT_STEPS):
            bouts[world], first[world], following = following, 0, following + 1


@pytest.mark.parametrize("worlds", [-1, 5000])
def test_nobody_plays_that_many_bouts_side_by_side(worlds: int):
    ruling = check_contents(msgspec.structs.replace(rollout(), worlds=worlds), BOUT_STEPS)
    assert ruling.decision is Decision.DROP
    assert ruling.reason == f"{worlds} bouts side by side; at most 4096 are"


def test_what_was_handed_over_before_is_not_new_whatever_part_of_it():
    one = rollout(worlds=8)
    before = Played()
    assert check_new(one, before).decision is Decision.LEARN
    before.add(one)
    for shift in (-7, -1, 0, 3, 7):
        again = msgspec.structs.replace(one, first_step=one.first_step + np.int32(shift))
        assert check_new(again, before).reason.startswith("replayed: bout")
    following = msgspec.structs.replace(one, first_step=one.first_step + np.int32(8))
    assert check_new(following, before).decision is Decision.LEARN


def some_worlds(whole: Rollout, parts: int) -> Iterator[Rollout]:
    """The bouts and steps of a rollout, as so many rollouts of some of its worlds each."""
    for ids in np.array_split(np.arange(len(whole.bouts)), parts):
        yield msgspec.structs.replace(
            whole, bouts=whole.bouts[ids], first_step=whole.first_step[ids],
            rewards=whole.rewards[:, ids], worlds=len(whole.bouts),
        )  # fmt: skip


@pytest.mark.parametrize(("worlds", "parts"), [(8, 1), (96, 1), (96, 5)])
@pytest.mark.parametrize("lost", [0.0, 0.4])
def test_a_lease_that_lives_for_days_takes_no_more_memory_and_loses_nothing(
    worlds: int, parts: int, lost: float
):
    before, dice = Played(), np.random.default_rng(3)
    late: list[Rollout] = []
    pieces = (piece for whole in played(400, worlds) for piece in some_worlds(whole, parts))
    for number, each in enumerate(pieces):
        if dice.random() < lost:  # dropped as stale, never handed over again; or a little late
            late = [*late, each][-6:] if number % 2 else late
            continue
        for one in (each, *late):
            assert check_new(one, before).decision is Decision.LEARN
            before.add(one)
        late = []
        assert len(before) <= KEPT_BOUTS * worlds
    for each in itertools.islice(played(400, worlds), 0, None, 50):
        assert check_new(each, before).decision is Decision.DROP or lost
    assert check_new(next(played(1, worlds)), before).decision is Decision.DROP
