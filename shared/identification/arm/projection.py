"""What a signal is without what other columns may have to do with it."""

import numpy as np

from shared.identification.dataset.types import Float64

_TINY = 1e-18
"""Less than any length: what is 0 all the time, is divided by it."""


def basis_of(columns: Float64, rank: float) -> Float64:
    """Return float64[N, R], of length 1 and at right angles, for float64[N, K].

    Args:
        columns: in units of their own; any may be 0, or sums of others.
        rank: of the largest singular value: what is less is nothing (1).
    """
    lengths = np.maximum(np.linalg.norm(columns, axis=0), _TINY)
    basis, sizes, _ = np.linalg.svd(columns / lengths, full_matrices=False)
    return np.asarray(basis[:, sizes > rank * sizes[0]], np.float64)


def without(basis: Float64, signal: Float64) -> Float64:
    """Return float64[N, K] without what a basis makes of it."""
    return signal - basis @ (basis.T @ signal)
