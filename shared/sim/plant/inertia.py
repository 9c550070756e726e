"""How hard a body is to turn."""

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.row import Row


def add_inertia(row: Row, body: int, more: Float64) -> None:
    """Make a body harder to turn about its centre of mass.

    Args:
        row: the arm.
        body: of its model.
        more: float64[3, 3], along the body's own axes (kg m^2).
    """
    if not more.any():
        return
    inertia, quaternion = row.field("body_inertia")[body], row.field("body_iquat")[body]
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, quaternion)
    turned = axes.reshape(3, 3)
    principal, vectors = np.linalg.eigh(turned @ np.diag(inertia) @ turned.T + more)
    vectors[:, 0] *= np.sign(np.linalg.det(vectors))  # a rotation, no mirror
    inertia[:] = principal
    mujoco.mju_mat2Quat(quaternion, vectors.ravel())
