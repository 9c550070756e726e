"""Huber's loss (1964) for least squares: residuals whose squares, halved, are the loss.

What resonates while a chirp goes through is off by a hundred noise floors as soon as its damping is
another than the model's, and would outweigh all that is told by everything else.
"""

import numpy as np

from shared.identification.dataset.types import Float64

FAR_OFF = 4.0
"""Residual from which a fit is pulled no harder, in noise floors: it is no noise any more."""


def tempered(residuals: Float64) -> Float64:
    """Return float64[...]: residuals in noise floors, of what is far off the root."""
    size = np.abs(residuals)
    far: Float64 = np.sqrt(FAR_OFF * np.maximum(2.0 * size - FAR_OFF, FAR_OFF))
    return np.where(size > FAR_OFF, np.copysign(far, residuals), residuals)


def restored(residual: Float64, jacobian: Float64) -> tuple[Float64, Float64]:
    """Return the residual that was tempered, and its derivative.

    Args:
        residual: float64[M], tempered.
        jacobian: float64[M, n], of the tempered residual.
    """
    size = np.abs(residual)
    is_far = size > FAR_OFF
    plain = np.copysign(0.5 * (residual**2 / FAR_OFF + FAR_OFF), residual)
    slope = np.where(is_far, size / FAR_OFF, 1.0)
    return np.where(is_far, plain, residual), jacobian * slope[:, None]
