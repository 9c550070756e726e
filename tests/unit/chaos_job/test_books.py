"""The books catch what must not be: planted here, counted there."""

import hashlib
from pathlib import Path

import pytest

from services.jobs.chaos.books import Books, Toll
from services.league.events import BoutsPlayed, Event, LeaseGranted, VersionEntered
from tests.unit.policy.making import snapshot


@pytest.fixture
def store(tmp_path: Path) -> Path:
    (tmp_path / f"{DIGEST}.safetensors").write_bytes(PAYLOAD)
    return tmp_path


PAYLOAD = snapshot().payload
DIGEST = hashlib.sha256(PAYLOAD).hexdigest()


def version(number: int, *rollouts: str, digest: str = DIGEST) -> VersionEntered:
    return VersionEntered(
        agent="antagonist", version=number, stage=0, snapshot=digest, rollouts=rollouts,
        metrics=None,
    )  # fmt: skip


def lease(name: str = "L1") -> LeaseGranted:
    return LeaseGranted(
        lease=name, number=1, actor="actor-0", boot="b", work="train", stage=0, antagonist="",
        protagonist="scripted:static", seed=1,
    )  # fmt: skip


def bouts(name: str, *numbers: int) -> BoutsPlayed:
    zeros = (0,) * len(numbers)
    return BoutsPlayed(
        name=name, actor="actor-0", lease="L1", stage=0, antagonist="sha256:a", protagonist="b",
        model="m", bouts=numbers, score=(0.0,) * len(numbers), attack_steps=zeros,
        penalty_steps=zeros, camping_steps=zeros, complete=(True,) * len(numbers),
    )  # fmt: skip


def books(store: Path, told: str, *events: Event) -> Books:
    """Return books in which these rollouts and results were acknowledged."""
    made = Books()
    for word in told.split():
        kind = "results_acknowledged" if word.startswith("r") else "rollout_acknowledged"
        made.hear({"event": kind, "name": word})
    for event in events:
        made.enter(event, store)
    return made


WHOLE = (lease(), version(1, "a:0", "a:1"), version(2, "b:0"), bouts("r:0", 0, 1), bouts("r:1", 2))


def test_books_that_agree_count_nothing(store: Path):
    found = books(store, "a:0 a:1 b:0 r:0 r:1", *WHOLE)
    assert found.toll == Toll()
    assert found.toll.is_none
    assert found.size == 5


def test_what_was_applied_and_not_yet_acknowledged_is_no_loss(store: Path):
    assert books(store, "a:0", *WHOLE).toll.is_none


def test_an_acknowledged_rollout_that_no_version_names_is_lost(store: Path):
    assert books(store, "a:0 a:7", *WHOLE).toll == Toll(lost=1)


def test_acknowledged_results_that_the_ledger_lacks_are_lost(store: Path):
    assert books(store, "r:0 r:9", *WHOLE).toll == Toll(lost=1)


def test_a_rollout_behind_two_versions_was_applied_twice(store: Path):
    assert books(store, "a:0", *WHOLE, version(3, "a:1")).toll == Toll(twice=1)


def test_a_rollout_twice_in_one_version_was_applied_twice(store: Path):
    assert books(store, "", *WHOLE, version(3, "c:0", "c:0")).toll == Toll(twice=1)


def test_a_bout_of_a_lease_that_two_results_name_counts_twice(store: Path):
    assert books(store, "", *WHOLE, bouts("r:2", 2)).toll == Toll(twice=1)


def test_a_snapshot_that_is_not_what_its_hash_says_is_bad(store: Path):
    damaged = bytearray(PAYLOAD)
    damaged[len(damaged) // 2] ^= 1
    other = "0" * 64
    (store / f"{other}.safetensors").write_bytes(damaged)
    assert books(store, "", *WHOLE, version(3, digest=other)).toll == Toll(bad_snapshots=1)


def test_a_version_without_its_snapshot_is_bad(store: Path):
    assert books(store, "", *WHOLE, version(3, digest="1" * 64)).toll == Toll(bad_snapshots=1)


def test_a_forged_rollout_that_was_learned_from_is_counted(store: Path):
    made = books(store, "", *WHOLE, version(3, "liar:7"))
    made.hear({"event": "lie_told", "lie": "replayed", "name": "liar:7", "is_forged": True})
    assert made.toll == Toll(lies=1)
    made.hear({"event": "lie_refused", "lie": "replayed", "name": "liar:7"})
    assert made.refused == made.told


def test_a_toll_is_what_came_since_the_one_before():
    assert Toll(lost=3, twice=1).since(Toll(lost=1)) == Toll(lost=2, twice=1)
