"""What others would do with the same data set: a base fit, everything at once, a net."""

from typing import Any

import numpy as np

from benchmarks.identification.all_at_once import all_at_once
from benchmarks.identification.base_only import base_only
from benchmarks.identification.mlp import mlp
from shared.identification.search.searched import Search


def baselines(found: Search, seed: int) -> dict[str, Any]:
    """Return what each baseline names, and the share of the explainable that it removes.

    Args:
        found: a search with its base fitted, which all of them begin with.
        seed: of everything random.
    """
    rng = np.random.default_rng(seed)
    return {
        "base_only": base_only(found),
        "all_at_once": all_at_once(found, rng),
        "mlp": mlp(found, rng),
    }
