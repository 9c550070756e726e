"""From kept runs to coefficients and checks, on runs that follow planted coefficients."""

import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks import scale
from benchmarks.scaling.kept import KeptRuns
from benchmarks.scaling.measure import CPU_FIGURES, _name, measure
from benchmarks.scaling.model import Coefficients, Job, Site, predict
from benchmarks.scaling.plan import FULL
from benchmarks.scaling.site import Crowd, Setup
from shared.errors import RiposteError
from tests.unit.scaling.test_model import PLANTED, run_of

CORES = 2


def kept_run(setup: Setup, purpose: str, crowd: Crowd) -> dict[str, Any]:
    """Return what a crowd would leave if the planted coefficients were the truth."""
    rate = crowd.rollouts_per_s or 30.0
    run = run_of(crowd.actors, rate, setup.num_envs, setup.batch_rollouts)
    memory = {
        "process": "router-0", "actors": crowd.actors, "resident_mb": 90.0, "mb_per_hour": 0.0,
        "low": -1.0, "high": 1.0, "seconds": 180.0,
    }  # fmt: skip
    return run | {
        "site": setup.name, "purpose": purpose, "batch_samples": setup.batch_samples,
        "offered_per_s": crowd.rollouts_per_s * setup.rollout_samples, "hosts": 0.5,
        "learner": run["learner_thread"] + run["learner_threads"], "dropped_per_s": 0.0,
        "bytes_out_per_s": 1.0, "memory": [memory] if purpose == "memory" else [],
        "schedule_bytes": PLANTED.schedule_bytes, "lease_bytes": PLANTED.lease_bytes,
        "policy_bytes": PLANTED.policy_bytes,
        "sample_bytes": PLANTED.rollout_bytes, "piece_s": 2e-3,
    }  # fmt: skip


def real_run(actors: int) -> dict[str, Any]:
    rate = predict(PLANTED, Site(cores=CORES), Job(), actors).samples_per_s
    return {"actors": actors, "samples_per_s": rate, "cpu_s": 40.0, "wall_s": 20.0,
            "piece_s": 2e-3}  # fmt: skip


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Return a file with every run of the full plan."""
    path = tmp_path / "scale.jsonl"
    kept = KeptRuns(path, lambda _: None)
    parts = {"actor_s": PLANTED.actor_s, "update_s": PLANTED.update_s, "piece_s": 2e-3}
    kept.get("an actor and PPO alone", lambda: parts)
    for setup, steps in FULL.sites:
        for purpose, crowd in steps:
            made = kept_run(setup, purpose, crowd)
            kept.get(_name(setup, crowd), lambda made=made: made)
    for actors in FULL.real_actors:
        kept.get(f"{actors} real actors", lambda actors=actors: real_run(actors))
    return path


def test_the_full_plan_finds_what_was_planted_and_predicts_it(runs: Path):
    found = scale.found_of(FULL, runs, only_kept=True)
    memory = {name for name in Coefficients.__struct_fields__ if name.endswith("per_actor")}
    for name in set(Coefficients.__struct_fields__) - memory:
        wanted = getattr(PLANTED, name)
        assert getattr(found.coefficients, name) == pytest.approx(wanted, rel=0.02), name
    assert found.skipped == ()
    assert {run["actors"] for run in found.real} == {1, 2, 3, 4}
    costs = [check for check in found.checks if check.unit == "cores"]
    assert len(costs) == 4 * 5  # four checks and the largest crowd, four processes each
    assert max(abs(check.error) for check in costs) < 0.02
    real = [check for check in found.checks if check.what == "rate, real"]
    assert max(abs(check.error) for check in real) < 0.02
    report = scale.measurement(found)
    assert report.ratio.is_met
    assert {check.name: check.value for check in report.checks}["synthetic actors at most"] == 1000


def test_cores_that_were_slow_for_a_while_change_nothing(runs: Path):
    kept = [json.loads(line) for line in runs.read_text().splitlines()]
    for one in kept[2:7]:
        found = one["found"]
        found |= {name: 1.7 * found[name] for name in (*CPU_FIGURES, "piece_s")}
    runs.write_text("".join(json.dumps(one) + "\n" for one in kept))
    found = scale.found_of(FULL, runs, only_kept=True)
    assert found.coefficients.router_actor_s == pytest.approx(PLANTED.router_actor_s, rel=0.02)
    costs = [check for check in found.checks if check.unit == "cores"]
    assert max(abs(check.error) for check in costs) < 0.02
    assert found.speeds == (pytest.approx(1 / 1.7), 1.0)


def test_without_any_run_there_are_no_coefficients(tmp_path: Path):
    kept = KeptRuns(tmp_path / "scale.jsonl", lambda _: None, only_kept=True)
    with pytest.raises(RiposteError, match="too few runs"):
        measure(FULL, CORES, kept)
