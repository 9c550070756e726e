"""All effects at once: CMA-ES over base and every candidate, with an L1 penalty on their sizes.

Candidates that need joints of their own are left out: all of them in one arm would be another arm.
The name is that of the largest size in probes.
"""

import time
from typing import Any

import numpy as np

from benchmarks.identification.base_only import share_removed
from shared.identification.fitting.cmaes import minimize
from shared.identification.fitting.space import Space
from shared.identification.gate.held_out import plain_stretches
from shared.identification.search.searched import Search

PENALTY = 0.05
"""Of the loss per candidate at its probe, as a share of what the base fit leaves."""
GENERATIONS = 40


def all_at_once(found: Search, rng: np.random.Generator) -> dict[str, Any]:
    """Return what it names, and the share of the explainable that it removes."""
    begin = time.process_time()
    problem = found.problem
    chosen = tuple(
        each for each in found.candidates if not each.effect.structure(problem.subject, each.place)
    )
    space = Space(problem, chosen)
    low, high = space.bounds
    start = np.concatenate([found.base.z, np.zeros(space.size - len(found.base.z))])
    start = np.clip(start, low, high)
    train = problem.of("train")
    weight = PENALTY * 2.0 * found.base.cost

    def losses(zs: np.ndarray) -> np.ndarray:
        residual = space.residual([space.clip(z) for z in zs], train)
        sizes = np.abs(zs[:, space.base_size :]).sum(axis=1)
        return np.sum(np.minimum(residual**2, 1e8), axis=1) + weight * sizes

    seed = int(rng.integers(1, 2**31 - 1))
    best = minimize(losses, start, low, high, sigma=0.1, seed=seed, generations=GENERATIONS)
    sizes = np.abs(best[space.base_size :])
    owners = [each for each in chosen for _ in each.effect.quantities(problem.subject, each.place)]
    largest = owners[int(np.argmax(sizes))]
    variant = space.variant(space.clip(best))
    loss = float(plain_stretches(problem, variant, problem.of("test")).mean())
    return {
        "name": largest.effect.name,
        "where": largest.place,
        "share_removed": share_removed(found, loss),
        "loss": loss,
        "cpu_s": time.process_time() - begin,
    }
