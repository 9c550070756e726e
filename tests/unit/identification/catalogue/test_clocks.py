from dataclasses import replace

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.clock_skew import EFFECT as SKEW
from shared.identification.catalogue.tracker_latency import EFFECT as LATENCY
from shared.identification.dataset.types import Float64
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.replay import Reports
from shared.sim.plant.signals import Signal, sampled
from tests.arms import make_plant, make_subject, recorded, replay


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return make_subject(make_plant(tmp_path_factory.mktemp("arm"), has_gravity=False))


def _turning(at: Float64) -> Float64:
    return np.stack([0.8 * at, 0.0 * at, 0.0 * at], axis=1)


def _tracker(reports: Reports) -> Float64:
    assert reports.tracker is not None
    return reports.tracker


def test_a_late_tracker_trails_by_speed_times_delay(subject: Subject):
    ramp = recorded(_turning, seconds=2.0)
    plain = replay(subject, ramp)
    late = replay(subject, ramp, LATENCY, "", [0.03])

    np.testing.assert_array_equal(late.q, plain.q)
    np.testing.assert_allclose(_tracker(late)[103:], _tracker(plain)[100:-3], atol=1e-6)
    # The tool is 0.7 m out and turns at 0.8 rad/s.
    trailing = np.linalg.norm(_tracker(late)[-1, :3] - _tracker(plain)[-1, :3])
    assert trailing == pytest.approx(0.7 * 0.8 * 0.03, rel=0.02)


def test_a_negative_delay_is_a_clock_that_is_behind(subject: Subject):
    ramp = recorded(_turning, seconds=2.0)
    early = _tracker(replay(subject, ramp, LATENCY, "", [-0.02]))
    np.testing.assert_allclose(early[100:150], _tracker(replay(subject, ramp))[102:152], atol=1e-6)


def test_a_fast_clock_lags_more_and_more(subject: Subject):
    ramp = recorded(lambda at: 0.5 * _turning(at), seconds=4.0)
    plain = _tracker(replay(subject, ramp))
    fast = _tracker(replay(subject, ramp, SKEW, "", [5000.0]))
    for row in (100, 200, 399):
        lag = 0.01 * row * 5e-3 / 1.005
        expected = 0.7 * 0.4 * lag
        assert np.linalg.norm(fast[row, :3] - plain[row, :3]) == pytest.approx(expected, rel=0.03)


def test_skew_counts_from_where_the_recording_began(subject: Subject):
    """A part of a recording, 10 s in: 1000 ppm are 10 ms there already."""
    ramp = recorded(_turning, seconds=2.0)
    part = replace(ramp, begin=10.0)
    skewed = _tracker(replay(subject, part, SKEW, "", [1000.0]))
    late = _tracker(replay(subject, part, LATENCY, "", [0.01]))
    np.testing.assert_allclose(skewed[100], late[100], atol=1.5e-3 * 0.8 * 0.7)
    assert np.linalg.norm(skewed[100, :3] - _tracker(replay(subject, part))[100, :3]) > 4e-3


def test_what_was_seen_before_a_part_began_is_taken_from_the_log(subject: Subject):
    """The part begins in the middle of a turn that the log has from its start."""
    at: Float64 = np.arange(-0.5, 1.0, 0.01)
    q = np.stack([0.8 * at, 0.0 * at, 0.0 * at], axis=1)
    part = replace(
        recorded(_turning),
        initial_qd=np.array([0.8, 0.0, 0.0]),
        logged_q=Signal(at, q),
        begin=0.5,
    )
    late = _tracker(replay(subject, part, LATENCY, "", [0.1]))
    assert part.tracker_at is not None
    early = part.tracker_at < 0.1
    posture = sampled(at, q, part.tracker_at[early] - 0.1)
    there = tool_poses(subject.plant, subject.nominal.model, posture)
    np.testing.assert_allclose(late[early], there, atol=1e-9)


def test_clocks_need_a_tracker(subject: Subject):
    unseen = replace(subject, has_tracker=False)
    assert LATENCY.places(subject) == SKEW.places(subject) == ("",)
    assert LATENCY.places(unseen) == SKEW.places(unseen) == ()


def test_the_longer_the_recording_the_smaller_a_skew_is_tried(subject: Subject):
    assert SKEW.quantities(replace(subject, duration=60.0), "")[0].probe == pytest.approx(
        166.7, 0.01
    )
    assert SKEW.quantities(replace(subject, duration=2.0), "")[0].probe == pytest.approx(2000.0)
