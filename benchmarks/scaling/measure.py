"""Runs a plan: sites with synthetic actors, training runs with real ones, coefficients, checks."""

import contextlib
import math
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.scaling import recorded
from benchmarks.scaling.fit import LEAST_CPU, fit
from benchmarks.scaling.model import Coefficients, Job, Site, learner_thread, loads, predict
from benchmarks.scaling.plan import Plan, Step
from benchmarks.scaling.site import (
    LEARNER,
    OVER_SOCKETS,
    START_SECONDS,
    ScalingSite,
    scaling_site,
)
from benchmarks.slopes import slope
from benchmarks.training_run import ENDLESS, training_run
from services.learner.config import LearnerConfig
from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.errors import RiposteError
from shared.messages.topics import POLICY, SCHEDULE
from shared.messages.wire import encode

Say = Callable[[str], None]


class Check(msgspec.Struct, frozen=True, kw_only=True):
    """One figure beside its prediction."""

    what: str
    actors: int
    unit: str
    predicted: float
    measured: float

    @property
    def error(self) -> float:
        """Return (predicted - measured) / measured; a share of a core below 0.01 counts as 0.01."""
        least = LEAST_CPU if self.unit == "cores" else 1e-12
        return (self.predicted - self.measured) / max(self.measured, least)


class Memory(msgspec.Struct, frozen=True, kw_only=True):
    """Growth of a process's memory under the largest crowd."""

    process: str
    actors: int
    resident_mb: float
    mb_per_hour: float | None
    low: float | None
    """95 % interval."""
    high: float | None
    seconds: float


class Found(msgspec.Struct, frozen=True, kw_only=True):
    """Everything that one measurement yields; kept as ``measured.json``."""

    coefficients: Coefficients
    cores: int
    checks: tuple[Check, ...]
    memory: tuple[Memory, ...]
    runs: tuple[dict[str, Any], ...]
    """Of synthetic actors, as ``ScalingSite.watch`` returned them, with ``purpose``."""
    real: tuple[dict[str, Any], ...]
    """Of real actors, as ``TrainingRun.window`` returned them, with ``actors``."""
    skipped: tuple[str, ...] = ()
    """Crowds that this machine did not bring to work in time, and why."""

    @property
    def error(self) -> float:
        """Return the median size of the checks' errors; NaN when there is none."""
        errors = [abs(check.error) for check in self.checks]
        return statistics.median(errors) if errors else math.nan


def message_sizes(site: ScalingSite) -> dict[str, float]:
    """Return the bytes of the schedule for each lease, and of an announced policy.

    Raises:
        RiposteError: nothing was announced.
    """
    clock = SystemClock()
    cfg = BusConfig(connect=(site.endpoint,), open_seconds=60.0, lease_seconds=30.0)
    with contextlib.closing(open_zenoh(cfg, "scale", clock, site.folder.name)) as bus:
        schedules, policies = bus.subscribe(SCHEDULE), bus.subscribe(POLICY, agent="antagonist")
        found: dict[str, float] = {}
        end = clock.now() + START_SECONDS
        while len(found) < 2 and clock.now() < end:
            bus.wait(0.2)
            if (schedule := schedules.take()) is not None and schedule.leases:
                found["schedule_bytes"] = len(encode(schedule)) / len(schedule.leases)
            if (policy := policies.take()) is not None:
                found["policy_bytes"] = float(len(encode(policy)))
    if len(found) < 2:
        raise RiposteError("no schedule or no policy was heard of the site")
    return found


def play(
    site: ScalingSite, step: Step, plan: Plan, say: Say
) -> tuple[dict[str, Any], list[Memory]]:
    """Put one crowd on a site and return what was seen of it."""
    purpose, crowd = step
    site.populate(crowd)
    seen = site.watch(plan.seconds) | {"purpose": purpose}
    say(
        f"{site.setup.name}: {crowd.actors} actors, {seen['samples_per_s']:,.0f} samples/s, "
        f"router {seen['router']:.3f}, learner {seen['learner']:.3f}, league {seen['league']:.3f}"
    )
    return seen, watch_memory(site, plan.memory_seconds) if purpose == "memory" else []


def watch_memory(site: ScalingSite, seconds: float) -> list[Memory]:
    """Return how the memory of router, league and learners grows over so many seconds."""
    at: list[float] = []
    resident: list[dict[str, int]] = []
    begin = time.monotonic()
    while not at or at[-1] < seconds:
        site.check()
        at.append(time.monotonic() - begin)
        resident.append(site.resident())
        time.sleep(min(1.0, seconds / 20))
    made: list[Memory] = []
    for process in ("router-0", "league-0", LEARNER, "learner-protagonist"):
        series = [one[process] / 1e6 for one in resident]
        found = slope(at, series)
        made.append(
            Memory(
                process=process, actors=site.crowd.actors, resident_mb=series[-1],
                mb_per_hour=None if found is None else 3600 * found.value,
                low=None if found is None else 3600 * found.low,
                high=None if found is None else 3600 * found.high, seconds=at[-1],
            )
        )  # fmt: skip
    return made


def real_run(actors: int, plan: Plan) -> dict[str, Any]:
    """Return what a training run with so many real actors did."""
    words = (
        *ENDLESS, *OVER_SOCKETS, f"train.actors={actors}",
        f"bus.lease_seconds={plan.lease_seconds}",
    )  # fmt: skip
    with training_run(words) as run:
        return run.window(plan.seconds) | {"actors": actors}


def cpu_per_sample(run: dict[str, Any], prefix: str) -> float:
    """Return the CPU seconds of some processes of a training run for a sample."""
    spent = sum(used for name, used in run["cpu_s_by_process"].items() if name.startswith(prefix))
    return spent / run["samples"]


def synthetic_checks(found: Coefficients, run: dict[str, Any], cores: int) -> list[Check]:
    """Return what a crowd used beside what the model says of that crowd at that rate."""
    envs = run["rollout_samples"] // Job().rollout_steps
    job = Job(num_envs=envs, batch_samples=run["batch_samples"], does_update=False)
    actors, rate = run["actors"], run["samples_per_s"]
    at = {load.name: load.use(rate) for load in loads(found, Site(cores=cores), job, actors)}
    hosts = msgspec.structs.replace(found, actor_s=run["hosts"] / max(rate, 1.0))
    most = predict(hosts, Site(cores=cores), job, actors).samples_per_s
    offered = run["offered_per_s"] or math.inf
    named = (
        ("router", at["router"], run["router"]),
        ("league", at["league's thread"], run["league"]),
        ("learner, main thread", at["learner's thread"], run["learner_thread"]),
        ("learner, other threads", found.ingest_threads_s * rate, run["learner_threads"]),
    )
    made = [
        Check(
            what=f"rate, synthetic, {run['site']}", actors=actors, unit="samples/s",
            predicted=min(offered, most), measured=rate,
        )
    ]  # fmt: skip
    made += [
        Check(what=name, actors=actors, unit="cores", predicted=predicted, measured=measured)
        for name, predicted, measured in named
    ]
    return made


def real_checks(found: Coefficients, run: dict[str, Any], cores: int) -> list[Check]:
    """Return the rate of a training run beside what the model says of it."""
    actors, rate = run["actors"], run["samples_per_s"]
    had = run["cpu_s"] / run["wall_s"]
    return [
        Check(
            what="rate, real", actors=actors, unit="samples/s",
            predicted=predict(found, Site(cores=cores), Job(), actors).samples_per_s, measured=rate,
        ),
        Check(
            what=f"rate, real, on the {had:.2f} cores it had", actors=actors, unit="samples/s",
            predicted=predict(found, Site(cores=had), Job(), actors).samples_per_s, measured=rate,
        ),
    ]  # fmt: skip


def measure(plan: Plan, cores: int, say: Say) -> Found:
    """Return coefficients and checks.

    Args:
        plan: what to run.
        cores: of this machine.
        say: told of each run as it ends.
    """
    runs: list[dict[str, Any]] = []
    memory: list[Memory] = []
    sizes: dict[str, float] = {}
    skipped: list[str] = []
    payload = 0.0
    with tempfile.TemporaryDirectory() as name:
        for setup, steps in plan.sites:
            rollout = Path(name) / f"rollout-{setup.num_envs}"
            recorded.record(rollout, setup.num_envs)
            payload = rollout.stat().st_size / setup.rollout_samples
            with scaling_site(setup, rollout, plan.lease_seconds) as site:
                for step in steps:
                    try:
                        seen, grown = play(site, step, plan, say)
                    except RiposteError as error:  # too many for this machine: the others count
                        skipped.append(f"{setup.name}, {step[1].actors} actors: {error}")
                        say(f"left out: {skipped[-1]}")
                        continue
                    runs.append(seen)
                    memory += grown
                sizes = sizes or message_sizes(site)
    real: list[dict[str, Any]] = []
    for actors in plan.real_actors:
        real.append(real_run(actors, plan))
        say(f"{actors} real actors: {real[-1]['samples_per_s']:,.0f} samples/s")
    fitted = [run for run in runs if run["purpose"] == "fit"]
    found = fit(
        fitted, actor_s=cpu_per_sample(real[0], "actor-"), rollout_bytes=payload, update_s=0.0,
        schedule_bytes=sizes["schedule_bytes"], policy_bytes=sizes["policy_bytes"],
    )  # fmt: skip
    intake = learner_thread(found, Job(batch_samples=LearnerConfig().batch_samples))
    all_of_it = cpu_per_sample(real[0], LEARNER)
    found = msgspec.structs.replace(
        found, update_s=max(0.0, all_of_it - intake - found.ingest_threads_s)
    )
    checks: list[Check] = []
    for run in runs:
        if run["purpose"] in ("check", "memory"):
            checks += synthetic_checks(found, run, cores)
    for run in real:
        checks += real_checks(found, run, cores)
    return Found(
        coefficients=found, cores=cores, checks=tuple(checks), memory=tuple(memory),
        runs=tuple(runs), real=tuple(real), skipped=tuple(skipped),
    )  # fmt: skip
