"""Linear least squares, free and within bounds."""

# pyright: basic
# (scipy's types are partial)

import numpy as np
from scipy.optimize import lsq_linear

from shared.identification.dataset.types import Float64


def least_squares(columns: Float64, wanted: Float64) -> Float64:
    """Return float64[k]: the shares of columns that come nearest to what is wanted."""
    return np.asarray(np.linalg.lstsq(columns, wanted, rcond=1e-8)[0], np.float64)


def bounded(columns: Float64, wanted: Float64, low: Float64, high: Float64) -> Float64:
    """Return float64[k]: the shares of columns within bounds that come nearest to what is wanted.

    Args:
        columns: float64[M, k].
        wanted: float64[M].
        low: float64[k], below ``high``.
        high: float64[k].
    """
    q, r = np.linalg.qr(columns)
    return np.asarray(lsq_linear(r, q.T @ wanted, (low, high)).x, np.float64)
