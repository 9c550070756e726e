"""The measured parts of ``docs/scaling.md``: tables between markers, and the figure."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.scaling.limits import CENTRAL, GIGABIT, TEN_GIGABIT, limits
from benchmarks.scaling.measure import Found
from benchmarks.scaling.model import Coefficients, Job, Prediction, Site, loads, predict
from benchmarks.scaling.words import number, table
from shared.errors import RiposteError
from shared.runtime.files import atomic_write
from shared.telemetry.scaling_figures import Curve, scaling

PAGE, FIGURE = "scaling.md", "images/scaling.png"
ACTORS = (1, 2, 4, 8, 16, 32, 64, 128, 256, 512, 1000, 2000, 5000, 10_000)
SHOWN = (1, 2, 4, 8, 16, 64, 256, 1000, 2000, 5000, 10_000)


def sites() -> dict[str, Site]:
    """Return the sites of the table, by what they are called there."""
    return {
        "one machine, 2 cores": Site(cores=2.0),
        "one machine, 16 cores": Site(cores=16.0),
        "16 cores + actors elsewhere, 1 Gbit/s": Site(
            cores=CENTRAL, actor_cores=math.inf, link=GIGABIT
        ),
        "the same, 10 Gbit/s": Site(cores=CENTRAL, actor_cores=math.inf, link=TEN_GIGABIT),
        "the same, 8 learners, 32 relays": Site(
            cores=CENTRAL, actor_cores=math.inf, link=TEN_GIGABIT, learners=8, relays=32
        ),
    }


def predictions(cost: Coefficients, actors: Sequence[int]) -> dict[str, list[Prediction]]:
    """Return what each site does with each number of actors."""
    return {
        name: [predict(cost, site, Job().for_actors(n), n) for n in actors]
        for name, site in sites().items()
    }


def conditions(kept: dict[str, Any]) -> str:
    """Return where and when it was measured, in one paragraph."""
    machine = kept["machine"]
    skipped = [text.partition(":")[0] for text in kept["details"]["skipped"]]
    left_out = f" Not brought to work in time: {'; '.join(skipped)}." if skipped else ""
    quiet = "quiet" if machine["quiet"] else "busy with other work: **to be measured again**"
    error = f"{kept['ratio']:.0%}"
    slowest, fastest = kept["details"]["speeds"]
    return (
        f"Measured with `python -m benchmarks.scale --plan {kept['plan']} --write`, commit "
        f"{kept['commit']}, on {machine['cores']} cores of an {machine['name']}, Python "
        f"{machine['python']}, in {kept['wall_s'] / 60:.0f} minutes, load average "
        f"{machine['load_before'][0]:.1f} before and {machine['load_after'][0]:.1f} after; the "
        f"machine was {quiet}. Its cores' speed, which others on the same hardware change, was "
        f"between {slowest:.2f} and {fastest:.2f} of the usual (a run each); coefficients are at "
        "the usual speed, predictions beside a run at that run's. Median error of all predictions "
        f"below: {error}.{left_out}"
    )


def coefficients(cost: Coefficients) -> str:
    """Return the table of the coefficients."""
    rows = (
        ("actor", "a sample", cost.actor_s, "physics, two policies, judging, encoding"),
        ("learner, main thread", "a sample", cost.ingest_s, "decoding, checking, holding"),
        ("learner, main thread", "a rollout", cost.ingest_rollout_s, "whatever its size"),
        ("learner, main thread", "a sample", cost.update_s, "PPO: four passes"),
        ("learner, main thread", "a version", cost.version_s, "checkpoint, snapshot, report"),
        ("learner, other threads", "a sample", cost.ingest_threads_s, "the bus"),
        ("router", "a MB of rollouts", 1e6 * cost.router_byte_s, "in and out"),
        ("router", "a rollout", cost.router_rollout_s, "whatever its size, and its answer"),
        ("router", "a MB sent to actors", 1e6 * cost.router_fan_out_byte_s, "schedule, policies"),
        ("router", "an actor, a second", cost.router_actor_s, "keep-alive, renewals, status"),
        ("league", "an actor, a second", cost.league_actor_s, "renewals"),
        ("league", "an actor and an actor, a second", cost.league_pair_s, "what answers look at"),
        ("league", "a version", cost.league_version_s, "checks, commit, snapshot"),
        (
            "league",
            "a version and an actor",
            cost.league_version_actor_s,
            "the list of leases anew",
        ),
    )
    return table(
        ("Where", "For", "CPU, us", "What it is"),
        [(where, unit, number(1e6 * value), what) for where, unit, value, what in rows],
    )


def sizes(cost: Coefficients) -> str:
    """Return the table of bytes and of memory."""
    rows = (
        ("a sample on the wire", f"{number(cost.rollout_bytes)} B"),
        ("a rollout of 128 bouts and 40 steps", f"{number(cost.rollout_bytes * 5120 / 1e6)} MB"),
        ("the schedule", f"{number(cost.schedule_bytes)} B"),
        ("a lease in the list of them", f"{number(cost.lease_bytes)} B"),
        ("an announced policy", f"{number(cost.policy_bytes / 1e3)} kB"),
        ("memory of the router, an actor", f"{number(cost.router_bytes_per_actor / 1e3)} kB"),
        ("memory of the league, an actor", f"{number(cost.league_bytes_per_actor / 1e3)} kB"),
        ("memory of a learner, an actor", f"{number(cost.learner_bytes_per_actor / 1e3)} kB"),
    )
    return table(("What", "Size"), rows)


def checks(found: Found) -> str:
    """Return the table of predictions beside measurements."""
    return table(
        ("Figure", "Actors", "Predicted", "Measured", "Error"),
        [
            (
                check.what, f"{check.actors:,}", f"{number(check.predicted)} {check.unit}",
                f"{number(check.measured)} {check.unit}", f"{check.error:+.0%}",
            )
            for check in found.checks
        ],
    )  # fmt: skip


def memory(found: Found) -> str:
    """Return the table of memory under the largest crowd."""
    return table(
        ("Process", "Synthetic actors", "Resident", "Growth, 95 % interval", "Watched"),
        [
            (
                one.process, f"{one.actors:,}", f"{one.resident_mb:.0f} MB",
                "-" if one.mb_per_hour is None or one.low is None or one.high is None
                else f"{one.mb_per_hour:+.1f} [{one.low:+.1f}, {one.high:+.1f}] MB/h",
                f"{one.seconds:.0f} s",
            )
            for one in found.memory
        ],
    )  # fmt: skip


def crowding(found: Found) -> str:
    """Return the table of what more actors than a batch has room for do to a learner."""
    rows: list[tuple[str, ...]] = []
    for run in found.runs:
        if run["purpose"] != "crowding":
            continue
        useful = run["samples_per_s"] * found.coefficients.rollout_bytes
        rows.append(
            (
                f"{run['actors']:,}", number(run["samples_per_s"]), number(run["dropped_per_s"]),
                f"{number(run['bytes_out_per_s'] / 1e6)} MB/s",
                number(run["bytes_out_per_s"] / max(useful, 1.0)),
                f"{run['learner_thread']:.2f}", f"{run['router']:.2f}",
                number(run["samples_per_s"] / max(run["versions_per_s"], 1e-9)),
            )
        )  # fmt: skip
    head = (
        "Actors", "Samples/s learned from", "Samples/s dropped", "Sent by actors",
        "Bytes sent / learned from", "Learner's main thread, cores", "Router, cores",
        "Samples a version",
    )  # fmt: skip
    return table(head, rows)


def rates(cost: Coefficients) -> str:
    """Return the table of predicted rates."""
    found = predictions(cost, SHOWN)
    rows: list[list[str]] = []
    for place, actors in enumerate(SHOWN):
        cells = [
            f"{number(one[place].samples_per_s)}, {one[place].bottleneck}" for one in found.values()
        ]
        rows.append([f"{actors:,}", *cells])
    return table(["Actors", *found], rows)


def figure(found: Found) -> bytes:
    """Return the figure of the page."""
    cost = found.coefficients
    curves = [
        Curve(name, ACTORS, [max(one.samples_per_s, 1.0) for one in predicted])
        for name, predicted in predictions(cost, ACTORS).items()
    ]
    site = Site(cores=CENTRAL, actor_cores=math.inf, link=GIGABIT)
    labels = {
        "league's thread": "league, of its one thread",
        "router": "router, of two cores",
        "link, out": "link of 1 Gbit/s, out",
    }
    uses = [
        Curve(label, ACTORS, [_standing(cost, site, n, name) for n in ACTORS])
        for name, label in labels.items()
    ]
    measured = [
        Curve(label, [run["actors"] for run in found.runs], values)
        for name, label in labels.items()
        if (values := _measured(cost, found, name))
    ]
    return scaling(curves, uses, measured)


def _standing(cost: Coefficients, site: Site, actors: int, name: str) -> float:
    made = loads(cost, site, Job().for_actors(actors), actors)
    load = next(load for load in made if load.name == name)
    return load.standing / load.capacity


def _measured(cost: Coefficients, found: Found, name: str) -> list[float]:
    """Return what each run's actors took of a resource, what its samples took left out."""
    key, capacity = {"league's thread": ("league", 1.0), "router": ("router", 2.0)}.get(
        name, ("", 1.0)
    )
    if not key:
        return []
    values: list[float] = []
    for run in found.runs:
        job = Job(
            num_envs=run["rollout_samples"] // Job().rollout_steps,
            batch_samples=run["batch_samples"],
        )
        made = loads(cost, Site(), job, run["actors"])
        load = next(load for load in made if load.name == name)
        values.append(max((run[key] - load.per_sample * run["samples_per_s"]) / capacity, 1e-4))
    return values


def blocks(kept: dict[str, Any]) -> dict[str, str]:
    """Return the text of each block of the page, by the name in its markers."""
    found = msgspec.convert(kept["details"], Found)
    cost = found.coefficients
    return {
        "conditions": conditions(kept),
        "coefficients": coefficients(cost),
        "sizes": sizes(cost),
        "rates": f"![What a site does with more and more actors]({FIGURE})\n\n{rates(cost)}",
        "checks": checks(found),
        "memory": memory(found),
        "crowding": crowding(found),
        "limits": limits(cost),
    }


def replaced(text: str, name: str, block: str) -> str:
    """Return a page with the text between two markers replaced.

    Raises:
        RiposteError: the page lacks the markers.
    """
    begin, end = f"<!-- {name}:begin -->", f"<!-- {name}:end -->"
    before, found, rest = text.partition(begin)
    _, closed, after = rest.partition(end)
    if not found or not closed:
        raise RiposteError(f"the page lacks {begin} ... {end}: put both in a line of their own")
    return f"{before}{begin}\n{block}\n{end}{after}"


def write(folder: Path, kept: dict[str, Any]) -> None:
    """Renew the page and its figure.

    Args:
        folder: ``docs``.
        kept: as in ``measured.json``.

    Raises:
        RiposteError: the page lacks a marker.
    """
    page = folder / PAGE
    text = page.read_text(encoding="utf-8")
    for name, block in blocks(kept).items():
        text = replaced(text, name, block)
    atomic_write(folder / FIGURE, figure(msgspec.convert(kept["details"], Found)))
    atomic_write(page, text.encode())
