"""Runs a plan: sites with synthetic actors, training runs with real ones, coefficients, checks."""

import contextlib
import math
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.scaling import recorded
from benchmarks.scaling.fit import LEAST_CPU, fit
from benchmarks.scaling.kept import KeptRuns
from benchmarks.scaling.model import Coefficients, Job, Site, loads, predict
from benchmarks.scaling.parts import costs
from benchmarks.scaling.plan import Plan, Step
from benchmarks.scaling.site import (
    LEARNER,
    OVER_SOCKETS,
    START_SECONDS,
    Crowd,
    ScalingSite,
    Setup,
    scaling_site,
)
from benchmarks.slopes import slope
from benchmarks.speed import pieces_timed
from benchmarks.training_run import ENDLESS, WARM_VERSION, training_run
from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.errors import RiposteError
from shared.messages.topics import LEASES, POLICY, SCHEDULE
from shared.messages.wire import encode

CPU_FIGURES = ("router", "league", "learner_thread", "learner_threads")
"""Of a run, CPU seconds a second: what coefficients are made from."""


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
    speeds: tuple[float, float] = (1.0, 1.0)
    """The slowest and the fastest that the cores were in a run, 1 being the median of the runs."""

    @property
    def error(self) -> float:
        """Return the median size of the checks' errors; NaN when there is none."""
        errors = [abs(check.error) for check in self.checks]
        return statistics.median(errors) if errors else math.nan


def message_sizes(site: ScalingSite) -> dict[str, float]:
    """Return the bytes of the schedule, of a lease, of a policy announced, of a sample.

    Raises:
        RiposteError: nothing was announced.
    """
    clock = SystemClock()
    cfg = BusConfig(connect=(site.endpoint,), open_seconds=60.0, lease_seconds=30.0)
    with contextlib.closing(open_zenoh(cfg, "scale", clock, site.folder.name)) as bus:
        schedules, leases = bus.subscribe(SCHEDULE), bus.subscribe(LEASES)
        policies = bus.subscribe(POLICY, agent="antagonist")
        found: dict[str, float] = {}
        end = clock.now() + START_SECONDS
        while len(found) < 3 and clock.now() < end:
            bus.wait(0.2)
            if (schedule := schedules.take()) is not None:
                found["schedule_bytes"] = float(len(encode(schedule)))
            if (known := leases.take()) is not None and known.leases:
                found["lease_bytes"] = len(encode(known)) / len(known.leases)
            if (policy := policies.take()) is not None:
                found["policy_bytes"] = float(len(encode(policy)))
    if len(found) < 3:
        raise RiposteError("no schedule, no lease or no policy was heard of the site")
    return found | {"sample_bytes": site.sample_bytes}


def play(site: ScalingSite, step: Step, plan: Plan) -> dict[str, Any]:
    """Put one crowd on a site and return what was seen of it."""
    purpose, crowd = step
    site.populate(crowd)
    with pieces_timed() as pieces:
        seen = site.watch(plan.seconds) | {"purpose": purpose}
    seen["piece_s"] = statistics.median(pieces)
    grown = watch_memory(site, plan.memory_seconds) if purpose == "memory" else []
    return seen | {"memory": [msgspec.to_builtins(one) for one in grown]} | message_sizes(site)


def play_all(plan: Plan, kept: KeptRuns) -> list[dict[str, Any]]:
    """Return what was seen of every crowd of a plan."""
    runs: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as folder:
        for setup, steps in plan.sites:
            names = {step: _name(setup, step[1]) for step in steps}
            missing = [step for step in steps if not kept.has(names[step])]
            with contextlib.ExitStack() as stack:
                site: ScalingSite | None = None
                if missing and not kept.only_kept:
                    rollout = Path(folder) / f"rollout-{setup.num_envs}"
                    recorded.record(rollout, setup.num_envs)
                    site = stack.enter_context(scaling_site(setup, rollout, plan.lease_seconds))
                for step in steps:
                    seen = kept.get(names[step], lambda: play(_there(site), step, plan))  # noqa: B023
                    if seen is None:
                        continue
                    runs.append(seen)
                    kept.say(
                        f"{names[step]}: {seen['samples_per_s']:,.0f} samples/s, router "
                        f"{seen['router']:.3f}, learner {seen['learner']:.3f}, league "
                        f"{seen['league']:.3f}"
                    )
    return runs


def _name(setup: Setup, crowd: Crowd) -> str:
    return f"{setup.name}, {crowd.actors} actors, {crowd.rollouts_per_s:g} rollouts/s"


def _there(site: ScalingSite | None) -> ScalingSite:
    assert site is not None  # it is opened where a run is missing
    return site


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
        run.wait_for_version(WARM_VERSION, deadline=2 * START_SECONDS)
        with pieces_timed() as pieces:
            window = run.window(plan.seconds)
        return window | {"actors": actors, "piece_s": statistics.median(pieces)}


def synthetic_checks(found: Coefficients, run: dict[str, Any], cores: int) -> list[Check]:
    """Return what a crowd used beside what the model says of that crowd at that rate.

    The rate itself is a prediction only where as much was sent as was acknowledged.
    """
    envs = run["rollout_samples"] // Job().rollout_steps
    job = Job(num_envs=envs, batch_samples=run["batch_samples"], does_update=False)
    actors, rate = run["actors"], run["samples_per_s"]
    at = {load.name: load.use(rate) for load in loads(found, Site(cores=cores), job, actors)}
    hosts = msgspec.structs.replace(found, actor_s=run["hosts"] / max(rate, 1.0))
    most = predict(hosts, Site(cores=cores), job, actors).samples_per_s
    named = (
        ("router", at["router"], run["router"]),
        ("league", at["league's thread"], run["league"]),
        ("learner, main thread", at["learner's thread"], run["learner_thread"]),
        ("learner, other threads", found.ingest_threads_s * rate, run["learner_threads"]),
    )
    made: list[Check] = []
    if not run["offered_per_s"]:
        made.append(
            Check(
                what=f"rate, synthetic, {run['site']}", actors=actors, unit="samples/s",
                predicted=most, measured=rate,
            )
        )  # fmt: skip
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


def measure(plan: Plan, cores: int, kept: KeptRuns) -> Found:
    """Return coefficients and checks.

    Args:
        plan: what to run.
        cores: of this machine.
        kept: runs made before, and where to keep those made now.

    Raises:
        RiposteError: too few runs came to work for any coefficient.
    """
    parts = kept.get("an actor and PPO alone", lambda: costs(plan.rounds))
    runs = play_all(plan, kept)
    fitted = [run for run in runs if run["purpose"] == "fit"]
    if parts is None or not fitted:
        raise RiposteError(f"too few runs for coefficients; left out: {'; '.join(kept.skipped)}")
    kept.say(f"actor {1e6 * parts['actor_s']:.2f} us, PPO {1e6 * parts['update_s']:.2f} us")
    real: list[dict[str, Any]] = []
    for actors in plan.real_actors:
        seen = kept.get(f"{actors} real actors", lambda: real_run(actors, plan))  # noqa: B023
        if seen is not None:
            real.append(seen)
            kept.say(f"{actors} real actors: {seen['samples_per_s']:,.0f} samples/s")
    pieces = [one["piece_s"] for one in (parts, *runs, *real)]
    usual = statistics.median(pieces)
    cost = coefficients_of([at_usual_speed(run, usual) for run in fitted], parts, usual)
    checks: list[Check] = []
    for run in runs:
        if run["purpose"] in ("check", "memory"):
            checks += synthetic_checks(cost.slowed(run["piece_s"] / usual), run, cores)
    for run in real:
        checks += real_checks(cost.slowed(run["piece_s"] / usual), run, cores)
    memory = [msgspec.convert(one, Memory) for run in runs for one in run["memory"]]
    return Found(
        coefficients=cost, cores=cores, checks=tuple(checks), memory=tuple(memory),
        runs=tuple(runs), real=tuple(real), skipped=tuple(kept.skipped),
        speeds=(usual / max(pieces), usual / min(pieces)),
    )  # fmt: skip


def at_usual_speed(run: dict[str, Any], usual: float) -> dict[str, Any]:
    """Return a run with the CPU seconds it would have used on cores of the usual speed.

    Args:
        run: of synthetic actors.
        usual: CPU seconds of a piece of work there.
    """
    return run | {name: run[name] * usual / run["piece_s"] for name in CPU_FIGURES}


def coefficients_of(
    fitted: list[dict[str, Any]], parts: dict[str, Any], usual: float
) -> Coefficients:
    """Return the coefficients that runs without PPO, and its cost and an actor's, give.

    Args:
        fitted: runs at the usual speed.
        parts: what an actor and PPO cost alone, at a speed of their own.
        usual: CPU seconds of a piece of work at the usual speed.
    """
    most = max(fitted, key=lambda run: run["actors"])
    slower = parts["piece_s"] / usual
    return fit(
        fitted, actor_s=parts["actor_s"] / slower, rollout_bytes=most["sample_bytes"],
        update_s=parts["update_s"] / slower, schedule_bytes=most["schedule_bytes"],
        lease_bytes=most["lease_bytes"], policy_bytes=most["policy_bytes"],
    )  # fmt: skip
