"""Coefficients from what sites with known crowds used: least squares, none below zero.

A run is what ``ScalingSite.watch`` returns. Every run is weighted by its size, so that a small one
counts as much as a large one.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.optimize import nnls

from benchmarks.scaling.model import LEARNERS, RESENDS, Coefficients

Run = dict[str, Any]
LEAST_CPU = 0.01
"""CPU seconds a second below which an error counts as if it were of so much."""


def fan_out(run: Run, schedule_bytes: float, lease_bytes: float, policy_bytes: float) -> float:
    """Return the bytes a second that the router delivered of what league and learners publish."""
    actors, versions = run["actors"], run["versions_per_s"]
    again = RESENDS * (schedule_bytes + 2.0 * policy_bytes + LEARNERS * lease_bytes)
    return actors * (again + versions * (schedule_bytes + policy_bytes))


def solve(rows: Sequence[Sequence[float]], values: Sequence[float]) -> list[float]:
    """Return the non-negative factors that make the rows into the values, by relative error."""
    weights = 1.0 / np.maximum(np.array(values, float), LEAST_CPU)
    matrix = np.array(rows, float) * weights[:, None]
    scale = np.maximum(np.abs(matrix).max(axis=0), 1e-300)  # columns differ by many powers of ten
    found, _ = nnls(matrix / scale, np.array(values, float) * weights)
    return [float(value) for value in found / scale]


def fit(
    runs: Sequence[Run], *, actor_s: float, rollout_bytes: float, update_s: float,
    schedule_bytes: float, lease_bytes: float, policy_bytes: float,
) -> Coefficients:  # fmt: skip
    """Return the coefficients that explain these runs.

    Args:
        runs: without PPO, of different crowds, batches and sizes of rollouts.
        actor_s: CPU seconds of a real actor for a sample.
        rollout_bytes: bytes of a sample.
        update_s: CPU seconds of PPO for a sample.
        schedule_bytes: of the schedule.
        lease_bytes: of a lease in the list of them.
        policy_bytes: of an announced policy.
    """
    rollouts = [run["samples_per_s"] / run["rollout_samples"] for run in runs]
    versions = [run["versions_per_s"] for run in runs]
    actors = [float(run["actors"]) for run in runs]
    sent = [run["samples_per_s"] * rollout_bytes for run in runs]
    router = solve(
        [
            (1.0, n, fan_out(run, schedule_bytes, lease_bytes, policy_bytes), size, count)
            for run, n, size, count in zip(runs, actors, sent, rollouts, strict=True)
        ],
        [run["router"] for run in runs],
    )
    thread = solve(
        [
            (1.0, run["samples_per_s"], count, version)
            for run, count, version in zip(runs, rollouts, versions, strict=True)
        ],
        [run["learner_thread"] for run in runs],
    )
    threads = solve(
        [(run["samples_per_s"],) for run in runs], [run["learner_threads"] for run in runs]
    )
    league = solve(
        [(1.0, n, n * n, v, v * n) for n, v in zip(actors, versions, strict=True)],
        [run["league"] for run in runs],
    )
    return Coefficients(
        actor_s=actor_s,
        rollout_bytes=rollout_bytes,
        learner_s=thread[0],
        ingest_s=thread[1],
        ingest_rollout_s=thread[2],
        ingest_threads_s=threads[0],
        update_s=update_s,
        version_s=thread[3],
        router_s=router[0],
        router_actor_s=router[1],
        router_fan_out_byte_s=router[2],
        router_byte_s=router[3],
        router_rollout_s=router[4],
        league_s=league[0],
        league_actor_s=league[1],
        league_pair_s=league[2],
        league_version_s=league[3],
        league_version_actor_s=league[4],
        schedule_bytes=schedule_bytes,
        lease_bytes=lease_bytes,
        policy_bytes=policy_bytes,
        router_bytes_per_actor=memory_slope(runs, "router-0"),
        league_bytes_per_actor=memory_slope(runs, "league-0"),
        learner_bytes_per_actor=memory_slope(runs, "learner-protagonist"),
    )


def memory_slope(runs: Sequence[Run], process: str) -> float:
    """Return the bytes of resident memory that each actor adds to a process.

    Only runs of the site with the most actors are compared: a process keeps what it once took.
    """
    largest = max(runs, key=lambda run: run["actors"])
    own = [run for run in runs if run["site"] == largest["site"]]
    if len({run["actors"] for run in own}) < 2:
        return 0.0
    actors = np.array([run["actors"] for run in own], float)
    held = np.array([run["resident"][process] for run in own], float)
    return max(0.0, float(np.polyfit(actors, held, 1)[0]))
