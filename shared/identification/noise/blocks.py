"""Means over blocks of time."""

import numpy as np

from shared.identification.dataset.types import Float64


def block_means(at: Float64, values: Float64, block: float) -> Float64:
    """Return float64[B, D]: means over blocks that follow each other from the first instant.

    Args:
        at: float64[T] (s), rising.
        values: float64[T', D] of the first T' instants.
        block: length (s); one without a reading is left out.
    """
    number = np.floor((at[: len(values)] - at[0]) / block + 1e-6).astype(np.int64)
    starts = np.flatnonzero(np.r_[True, np.diff(number) > 0])
    counts = np.diff(np.r_[starts, len(values)])[:, None]
    return np.add.reduceat(values, starts, axis=0) / counts
