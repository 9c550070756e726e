"""The one action decoder: six numbers become a bounded offset of the tool's current pose.

The bound is the PR2's own: beyond 3.75 cm or 0.06 rad its Jacobian-transpose controller commands
no more force (Kd x velocity saturation / Kp, pr2_jt_controllers.launch:18-41).
"""

import functools

import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.policy.schema import schema_hash

Floats = NDArray[np.float64]


class ActionConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Bounds of the commanded offset (section ``[action]``)."""

    offset_bound_m: float = 0.0375
    """Longest translation (m)."""
    offset_bound_rad: float = 0.06
    """Largest rotation (rad)."""

    def __post_init__(self) -> None:
        """Check the ranges."""
        if not 0.0 < self.offset_bound_m <= 0.3:
            raise ValueError(f"offset_bound_m ({self.offset_bound_m} m) must be in (0, 0.3]")
        if not 0.0 < self.offset_bound_rad <= 1.0:
            raise ValueError(f"offset_bound_rad ({self.offset_bound_rad} rad) must be in (0, 1]")


ACTION_SCHEMA = schema_hash(
    {
        "fields": ["translation[3]", "rotation[3]"],
        "units": "of the bound; longer vectors are shortened to it",
        "rotation": "twice the Gibbs vector: axis times 2 tan(angle / 2)",
        "frame": "torso_lift_link; pose = (p + translation, rotation q) of gripper_tool_frame",
    }
)


def bounded_offset(actions: Floats, cfg: ActionConfig) -> Floats:
    """Return the offsets that actions ask for, each vector at most as long as its bound.

    Args:
        actions: float64[..., 6, N], in units of the bounds.
        cfg: the bounds.

    Returns:
        float64[..., 6, N]: translation (m) and rotation (axis times 2 tan(angle / 2); rad to one
        part in 3,000 at the bound).
    """
    vectors = actions.reshape(*actions.shape[:-2], 2, 3, actions.shape[-1])
    lengths = np.sqrt(np.add.reduce(vectors * vectors, axis=-2))
    scale = _bounds(cfg) / np.maximum(lengths, 1.0)
    return (vectors * scale[..., None, :]).reshape(actions.shape)


@functools.lru_cache(maxsize=16)
def _bounds(cfg: ActionConfig) -> Floats:
    """Return float64[2, 1]: bound of the translation (m), of the rotation (rad)."""
    return np.array([[cfg.offset_bound_m], [cfg.offset_bound_rad]])


_FACTORS = 3 + np.array([[1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]])
_SIGNS = 0.5 * np.array([[-1, 1, -1, 1], [-1, 1, 1, -1], [-1, -1, 1, 1]])[:, :, None]
"""Half the product of a vector and a quaternion: which number of the tool's pose, and with which
sign, each number of the vector (a row) meets in each number of the result (a column)."""


def desired_pose(offsets: Floats, tools: Floats) -> Floats:
    """Return the poses to command: the tools' current poses moved by offsets.

    Args:
        offsets: float64[..., 6, N], translation (m) and rotation in the torso frame, as
            :func:`bounded_offset` returns them.
        tools: float64[..., 7, N], position and orientation (w x y z) in the torso frame.

    Returns:
        float64[..., 7, N]; the quaternions are longer than one by 1 / cos(angle / 2).
    """
    out = tools.copy()
    products = out.take(_FACTORS, axis=-2)
    out[..., :3, :] += offsets[..., :3, :]
    products *= _SIGNS
    products *= offsets[..., 3:, None, :]
    out[..., 3:, :] += np.add.reduce(products, axis=-3)
    return out
