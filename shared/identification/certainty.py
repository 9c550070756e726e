"""How sure a fitted number is, when noise is neither white nor all that is left."""

import numpy as np
from scipy.special import stdtrit

from shared.identification.dataset.types import Float64
from shared.identification.fit import Fit
from shared.identification.gate import STRETCH
from shared.identification.problem import BLOCK


def half_widths(fit: Fit, segments: tuple[int, ...]) -> Float64:
    """Return float64[n]: half of the 95 % interval of each coordinate.

    The covariance is a sandwich over stretches of ``STRETCH`` (Huber 1967, White 1982), so that
    neighbouring residuals may correlate and a misfit widens it.

    Args:
        fit: on the recordings ``segments``.
        segments: in the order in which the fit had them.
    """
    parts = fit.space.problem.residuals([fit.space.variant(fit.z)], segments)[0]
    size = round(STRETCH / BLOCK)
    scores: list[Float64] = []
    begin = 0
    for rows, channels in (part.shape for part in parts):
        end = begin + rows * channels
        weighted = (fit.jacobian[begin:end] * fit.residual[begin:end, None]).reshape(
            rows, channels, -1
        )
        count = max(rows // size, 1)
        scores += [piece.sum(axis=(0, 1)) for piece in np.array_split(weighted, count)]
        begin = end
    spread = np.stack(scores)
    bread = np.linalg.pinv(fit.jacobian.T @ fit.jacobian)
    n = len(scores)
    covariance = bread @ (spread.T @ spread) @ bread * n / max(n - 1, 1)
    factor = float(stdtrit(max(n - 1, 1), 0.975))
    return factor * np.sqrt(np.maximum(np.diag(covariance), 0.0))
