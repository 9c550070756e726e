"""What a site is said to have done and used between two moments."""

import pytest

from benchmarks.scaling.site import Crowd, Moment, Setup, used_between
from benchmarks.scaling.synthetic import Totals

SETUP = Setup("test", batch_rollouts=3, num_envs=4)


def moment(at: float, cpu: float, thread: float, version: int, *accepted: int) -> Moment:
    names = ("router-0", "league-0", "learner-antagonist", "learner-protagonist", "host-1-0")
    totals = [
        Totals(at=at, actors=2, put=2 * number, accepted=number, dropped=1, bytes_out=100 * number)
        for number in accepted
    ]
    return Moment(at, dict.fromkeys(names, cpu), thread, version, totals)


def test_rates_are_per_second_and_over_all_hosts():
    begin, end = moment(10.0, 1.0, 0.5, 4, 10, 20), moment(20.0, 3.0, 1.5, 9, 30, 50)
    used = used_between(begin, end, SETUP, Crowd(4, 8.0))
    assert used["samples_per_s"] == pytest.approx((2 + 3) * 160)
    assert used["offered_per_s"] == pytest.approx(8 * 160)
    assert used["dropped_per_s"] == 0.0
    assert used["bytes_out_per_s"] == pytest.approx(500)
    assert used["versions_per_s"] == pytest.approx(0.5)
    assert (used["router"], used["league"], used["hosts"]) == pytest.approx((0.2, 0.2, 0.2))
    assert (used["learner_thread"], used["learner_threads"]) == pytest.approx((0.1, 0.1))
    assert (used["actors"], used["batch_samples"], used["rollout_samples"]) == (4, 480, 160)


def test_an_actors_period_is_its_share_of_the_rate():
    assert Crowd(50, 25.0).period == 2.0
    assert Crowd(50, 0.0).period == 0.0
