"""What others would do with the same data set: a base fit, everything at once, a net."""

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.identification.all_at_once import all_at_once
from benchmarks.identification.base_only import base_only
from benchmarks.identification.mlp import mlp
from shared.identification.catalogue import effects
from shared.identification.dataset.types import Dataset
from shared.identification.fitting.saved import load
from shared.identification.progress import silent
from shared.identification.search.begin import begin


def baselines(dataset: Dataset, seed: int, steps: Path) -> dict[str, Any]:
    """Return what each baseline names, and the share of the explainable that it removes.

    Args:
        dataset: the recordings.
        seed: of everything random.
        steps: where the finder kept its base fit, which all of them begin with.
    """
    found = begin(
        dataset, seed=seed, progress=silent, without=frozenset(), catalogue=effects(),
        fits=load(steps, dataset, seed),
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    return {
        "base_only": base_only(found),
        "all_at_once": all_at_once(found, rng),
        "mlp": mlp(found, rng),
    }
