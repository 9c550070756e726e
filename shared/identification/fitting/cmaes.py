"""The door to ``cma``: minimises a loss of many vectors at once (Hansen 2016)."""

# pyright: basic
# (cma has no types)

from collections.abc import Callable

import cma
import numpy as np

from shared.identification.dataset.types import Float64

GENERATIONS = 15


def minimize(
    losses: Callable[[Float64], Float64],
    start: Float64,
    low: Float64,
    high: Float64,
    *,
    sigma: float,
    seed: int,
    generations: int = GENERATIONS,
) -> Float64:
    """Return the best vector found.

    Args:
        losses: float64[P, n] to float64[P].
        start: float64[n].
        low: float64[n].
        high: float64[n].
        sigma: first standard deviation.
        seed: of the search; not 0, which cma takes for the clock.
        generations: how many.
    """
    if not start.size:
        return start
    strategy = cma.CMAEvolutionStrategy(
        start.tolist(),
        sigma,
        {
            "seed": seed,
            "bounds": [low.tolist(), high.tolist()],
            "maxiter": generations,
            "verbose": -9,
            "CMA_diagonal": True,
        },
    )
    while not strategy.stop():
        asked = strategy.ask()
        strategy.tell(asked, losses(np.array(asked)).tolist())
    return np.array(strategy.result.xbest)
