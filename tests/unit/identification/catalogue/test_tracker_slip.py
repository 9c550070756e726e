from dataclasses import replace

import numpy as np
import pytest

from shared.identification.arm.slips import slip_of, slips_of
from shared.identification.arm.subject import Subject
from shared.identification.catalogue.tracker_slip import EFFECT
from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.poses import conjugate, rotated
from shared.sim.plant.replay import Reports
from tests.arms import make_plant, make_subject, recorded, replay

WAY = [0.004, -0.003, 0.0]


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return make_subject(make_plant(tmp_path_factory.mktemp("arm")))


def _waving(at: Float64) -> Float64:
    return np.stack([0.8 * np.sin(2 * at), 0.3 * np.sin(3 * at), 0.5 * np.sin(2.5 * at)], axis=1)


def _seen(
    subject: Subject, slip_at: float, noise: float, lag: float = 0.0, part: float = 1.0,
    seed: int = 5,
) -> Trajectory:  # fmt: skip
    """Return a recording of 6 s whose tracker moves by 5 mm, or a part, in the hand at a time."""
    rng = np.random.default_rng(seed)
    at: Float64 = np.arange(0.0, 6.0, 0.01)
    tracker = tool_poses(subject.plant, subject.nominal.model, _waving(at - lag))
    late = at >= slip_at
    tracker[late, :3] += rotated(tracker[late, 3:], part * np.array(WAY))
    tracker[:, :3] += noise * rng.standard_normal((len(at), 3))
    q = _waving(at)
    return Trajectory(
        "slow", "train", "", q[0], 0.0 * q[0], at, q, at, q, tracker_at=at, tracker=tracker
    )


def _tracker(reports: Reports) -> Float64:
    assert reports.tracker is not None
    return reports.tracker


@pytest.mark.parametrize("slip_at", [1.5, 4.2])
def test_a_slip_is_timed_without_simulating(subject: Subject, slip_at: float):
    assert slip_of(subject.nominal, _seen(subject, slip_at, 0.5e-3)) == pytest.approx(
        slip_at, abs=0.05
    )


def test_a_slip_is_timed_beside_a_lag_of_the_tracker(subject: Subject):
    found = slip_of(subject.nominal, _seen(subject, 3.3, 0.2e-3, lag=0.015))
    assert found == pytest.approx(3.3, abs=0.05)


def test_a_slip_of_hardly_more_than_a_reading_is_off_by_is_timed_all_the_same(subject: Subject):
    seen = [slip_of(subject.nominal, _seen(subject, at, 2.5e-3)) for at in (1.5, 3.0, 4.2)]
    assert seen == pytest.approx([1.5, 3.0, 4.2], abs=0.1)


def test_noise_alone_is_no_slip(subject: Subject):
    assert slip_of(subject.nominal, _seen(subject, 100.0, 0.5e-3)) is None


def test_a_slip_is_looked_for_in_each_recording_to_fit_to(subject: Subject):
    slipped, smooth = _seen(subject, 2.0, 0.3e-3), _seen(subject, 100.0, 0.3e-3)
    later = replace(_seen(subject, 4.0, 0.3e-3), name="fast")
    held_out = replace(slipped, name="other", split="test")
    recordings = (slipped, held_out, later)
    found = replace(subject, recordings=recordings)
    assert EFFECT.places(found) == ("slow", "fast")
    times = [EFFECT.quantities(found, place)[3].grid for place in ("slow", "fast")]
    assert [
        min(abs(np.array(each) - at)) for each, at in zip(times, (1.995, 3.995), strict=True)
    ] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert EFFECT.places(replace(subject, recordings=(smooth,))) == ()
    assert EFFECT.places(replace(subject, recordings=recordings, has_tracker=False)) == ()


def test_a_slip_too_small_to_see_in_a_second_is_timed_by_how_it_lasts(subject: Subject):
    recordings = [
        replace(_seen(subject, at, 2.5e-3, part=0.25, seed=seed), name=name)
        for seed, (name, at) in enumerate([("first", 100.0), ("second", 2.5), ("third", 0.0)], 10)
    ]
    assert slip_of(subject.nominal, recordings[1]) is None
    found = slips_of(subject.nominal, recordings)
    assert min(abs(at - 2.5) for at in found["second"]) < 0.1
    assert sum(len(times) for times in found.values()) <= 6


def test_where_it_stays_put_no_slip_is_looked_for(subject: Subject):
    recordings = [
        replace(_seen(subject, 100.0, 2.5e-3, lag=0.015, seed=seed), name=f"{seed}")
        for seed in range(4)
    ]
    assert slips_of(subject.nominal, recordings) == {}


def test_a_hand_that_never_moves_one_way_is_looked_at_all_the_same(subject: Subject):
    """A planar arm's hand has no velocity across, and without noise it is nowhere off there."""
    still = np.zeros((600, 3))
    seen = _seen(subject, 100.0, 0.0)
    assert seen.tracker_at is not None
    at_rest = tool_poses(subject.plant, subject.nominal.model, still)
    there = replace(seen, q=still, command=still, tracker=at_rest)
    assert slips_of(subject.nominal, [there]) == {}
    moved = at_rest.copy()
    moved[300:, :3] += rotated(at_rest[300:, 3:], np.array(WAY))
    times = slips_of(subject.nominal, [replace(there, tracker=moved)])["slow"]
    assert min(abs(at - 3.0) for at in times) < 0.02


def test_the_tracker_is_off_from_the_slip_on(subject: Subject):
    motion = recorded(_waving, seconds=2.0)
    plain = _tracker(replay(subject, motion))
    found = _tracker(replay(subject, motion, EFFECT, "slow", [*WAY, 0.995]))
    np.testing.assert_allclose(found[:100], plain[:100], atol=1e-12)
    in_hand = rotated(conjugate(plain[100:, 3:]), found[100:, :3] - plain[100:, :3])
    np.testing.assert_allclose(in_hand, np.tile(WAY, (100, 1)), atol=1e-12)


def test_it_stays_off_in_what_is_recorded_later_and_was_right_before(subject: Subject):
    motion = recorded(_waving, trajectory="third")
    later = replace(motion, earlier=("first", "second"))
    plain = _tracker(replay(subject, motion))
    moved = _tracker(replay(subject, later, EFFECT, "second", [*WAY, 3.0]))
    assert np.linalg.norm(moved[:, :3] - plain[:, :3], axis=1) == pytest.approx(0.005)
    before = _tracker(replay(subject, later, EFFECT, "fourth", [*WAY, 3.0]))
    np.testing.assert_array_equal(before, plain)


def test_the_reading_at_the_slip_shares_it(subject: Subject):
    motion = recorded(_waving, seconds=2.0)
    plain = _tracker(replay(subject, motion))
    found = _tracker(replay(subject, motion, EFFECT, "slow", [*WAY, 1.0]))
    moved = np.linalg.norm(found[:, :3] - plain[:, :3], axis=1)
    np.testing.assert_allclose(moved[99:102], [0.0, 0.0025, 0.005], atol=1e-9)


def test_in_a_part_of_a_recording_the_instant_is_the_recordings(subject: Subject):
    part = replace(recorded(_waving), begin=10.0)
    plain = _tracker(replay(subject, part))
    found = _tracker(replay(subject, part, EFFECT, "slow", [*WAY, 10.495]))
    np.testing.assert_allclose(found[:50], plain[:50], atol=1e-12)
    assert np.linalg.norm(found[50:, :3] - plain[50:, :3], axis=1) == pytest.approx(0.005)
