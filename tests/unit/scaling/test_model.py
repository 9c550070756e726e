"""The scaling model, against hand arithmetic and against itself."""

import dataclasses
import math

import msgspec
import pytest

from benchmarks.scaling.fit import fit
from benchmarks.scaling.model import (
    Coefficients,
    Job,
    Site,
    actors_at_limit,
    league,
    learner_thread,
    predict,
    router,
)

FREE = Coefficients(**dict.fromkeys(Coefficients.__struct_fields__, 0.0))
PLANTED = Coefficients(
    actor_s=8e-6, rollout_bytes=168.0, learner_s=2e-3, ingest_s=3e-7, ingest_rollout_s=2e-4,
    ingest_threads_s=1.5e-7, update_s=12e-6, version_s=6e-3, router_s=1e-3, router_byte_s=1.2e-9,
    router_rollout_s=1e-4, router_fan_out_byte_s=4e-10, router_actor_s=5e-5, league_s=8e-3,
    league_actor_s=1e-4, league_pair_s=2e-8, league_version_s=3e-3, league_version_actor_s=4e-6,
    schedule_bytes=300.0, lease_bytes=190.0, policy_bytes=33_000.0, router_bytes_per_actor=9e4,
    league_bytes_per_actor=2e3, learner_bytes_per_actor=500.0,
)  # fmt: skip


def priced(**costs: float) -> Coefficients:
    return msgspec.structs.replace(FREE, **costs)


def test_few_actors_hold_a_run_back_and_many_the_learner():
    found = priced(actor_s=40e-6, update_s=20e-6)
    site = Site(cores=8, actor_cores=100)
    one, five = (predict(found, site, Job(), actors) for actors in (1, 5))
    assert (one.bottleneck, one.samples_per_s) == ("actors", pytest.approx(25_000))
    assert five.bottleneck == "learner's thread"
    assert five.samples_per_s == pytest.approx(50_000)
    two = predict(found, dataclasses.replace(site, learners=2), Job(), 5)
    assert two.samples_per_s == pytest.approx(100_000)


def test_actors_that_share_the_machine_share_its_cores():
    found = priced(actor_s=10e-6, update_s=10e-6)
    assert predict(found, Site(cores=1), Job(), 4).samples_per_s == pytest.approx(50_000)
    shared = predict(found, Site(cores=1), Job(), 4)
    assert shared.bottleneck == "central machine's cores"
    assert shared.use("central machine's cores") == pytest.approx(1.0)


def test_a_link_carries_rollouts_one_way_and_everybodys_values_the_other():
    found = priced(rollout_bytes=100.0, policy_bytes=1000.0, schedule_bytes=10.0, lease_bytes=5.0)
    site = Site(actor_cores=math.inf, link=1e6)
    few = predict(found, site, Job(batch_samples=10**9), 2)
    assert (few.bottleneck, few.samples_per_s) == ("link, in", pytest.approx(10_000))
    assert few.load("link, out").standing == pytest.approx(2 * (10 + 2 * 1000))
    many = predict(found, site, Job(batch_samples=10**9), 1000)  # 1000 x 2 kB a second
    assert (many.bottleneck, many.samples_per_s) == ("link, out", 0.0)
    relayed = predict(found, dataclasses.replace(site, relays=10), Job(batch_samples=10**9), 1000)
    assert relayed.load("link, out").standing == pytest.approx(10 * (10 + 2000))


def test_ppo_left_out_costs_nothing_and_a_larger_batch_spreads_a_version():
    assert learner_thread(PLANTED, Job(does_update=False)) == pytest.approx(
        3e-7 + 2e-4 / 5120 + 6e-3 / 20480
    )
    assert learner_thread(PLANTED, Job()) > learner_thread(PLANTED, Job(batch_samples=40960))


def test_a_batch_grows_until_every_actors_rollout_fits():
    assert Job().for_actors(8) == Job()
    assert Job().for_actors(1000).batch_samples == 500 * 5120
    assert Job(num_envs=16).for_actors(1000).batch_samples == 500 * 640


@pytest.mark.parametrize("actors", [1, 10, 100, 1000, 10_000])
def test_the_predicted_rate_fills_the_bottleneck_and_nothing_else(actors: int):
    site = Site(cores=16, actor_cores=10_000, link=1.25e9)
    found = predict(PLANTED, site, Job().for_actors(actors), actors)
    for load in found.loads:
        if found.samples_per_s and load.name == found.bottleneck:
            assert found.use(load.name) == pytest.approx(load.capacity)
        elif found.samples_per_s:
            assert found.use(load.name) <= load.capacity * (1 + 1e-9)


def test_half_a_resource_is_taken_by_what_stands_on_it_at_its_limit():
    site = Site(cores=16, actor_cores=10_000)
    limit = actors_at_limit(PLANTED, site, Job(), "league's thread")
    # 8e-3 + n * 1e-4 + n**2 * 2e-8 = 0.5 at n = 3,054
    assert limit == pytest.approx(3054, abs=1)


def test_no_actor_at_all_is_refused():
    with pytest.raises(ValueError, match="at least 1"):
        predict(PLANTED, Site(), Job(), 0)


def run_of(actors: int, rollouts_per_s: float, worlds: int, batch_rollouts: int) -> dict:
    """Return what a site would show if the model with the planted coefficients were the truth."""
    job = Job(num_envs=worlds, batch_samples=batch_rollouts * worlds * 40, does_update=False)
    rate = rollouts_per_s * job.rollout_samples
    router_standing, router_sample = router(PLANTED, Site(), job, actors)
    league_standing, league_sample = league(PLANTED, job, actors)
    return {
        "site": worlds, "actors": actors, "samples_per_s": rate,
        "rollout_samples": job.rollout_samples, "versions_per_s": rate / job.batch_samples,
        "router": router_standing + router_sample * rate,
        "league": league_standing + league_sample * rate,
        "learner_thread": PLANTED.learner_s + learner_thread(PLANTED, job) * rate,
        "learner_threads": PLANTED.ingest_threads_s * rate,
        "resident": {
            "router-0": 6e7 + 9e4 * actors, "league-0": 7e7 + 2e3 * actors,
            "learner-protagonist": 4e8 + 500.0 * actors,
        },
    }  # fmt: skip


def test_planted_coefficients_are_found_again():
    runs = [
        run_of(*crowd)
        for crowd in (
            (25, 20.0, 16, 64), (100, 80.0, 16, 64), (250, 40.0, 16, 64), (400, 120.0, 16, 64),
            (8, 10.0, 128, 4), (16, 30.0, 128, 4), (12, 2.0, 128, 4),
            (20, 30.0, 16, 8), (50, 60.0, 16, 8),
        )
    ]  # fmt: skip
    found = fit(
        runs, actor_s=8e-6, rollout_bytes=168.0, update_s=12e-6, schedule_bytes=300.0,
        lease_bytes=190.0, policy_bytes=33_000.0,
    )  # fmt: skip
    for name in Coefficients.__struct_fields__:
        assert getattr(found, name) == pytest.approx(getattr(PLANTED, name), rel=1e-3), name
