"""The one action decoder: six numbers become a bounded offset of the tool's current pose.

The bound is the PR2's own: beyond 3.75 cm or 0.06 rad its Jacobian-transpose controller commands
no more force (Kd x velocity saturation / Kp, pr2_jt_controllers.launch:18-41).
"""

import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.policy.schema import schema_hash

Floats = NDArray[np.float64]
Actions = NDArray[np.float32]


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
        "fields": ["translation[3]", "rotation_vector[3]"],
        "units": "of the bound; longer vectors are shortened to it",
        "frame": "torso_lift_link; pose = (p + translation, exp(rotation) q) of gripper_tool_frame",
    }
)


def bounded_offset(actions: Actions, cfg: ActionConfig) -> Floats:
    """Return the offsets that actions ask for, each vector at most as long as its bound.

    Args:
        actions: float32[N, 6], in units of the bounds.
        cfg: the bounds.

    Returns:
        float64[N, 6]: translation (m) and rotation vector (rad).
    """
    vectors = actions.astype(np.float64).reshape(-1, 2, 3)
    lengths = np.sqrt(np.einsum("nij,nij->ni", vectors, vectors))
    scale = np.array([cfg.offset_bound_m, cfg.offset_bound_rad]) / np.maximum(lengths, 1.0)
    vectors *= scale[:, :, None]
    return vectors.reshape(-1, 6)


def desired_pose(offsets: Floats, tool_pose: Floats, out: Floats) -> None:
    """Write the pose to command: the tool's current pose moved by an offset.

    Args:
        offsets: float64[N, 6], translation (m) and rotation vector (rad) in the torso frame.
        tool_pose: float64[N, 7], position and orientation (w x y z) in the torso frame.
        out: float64[N, 7], written.
    """
    np.add(tool_pose[:, :3], offsets[:, :3], out=out[:, :3])
    half = 0.5 * offsets[:, 3:]
    angle = np.sqrt(np.einsum("ij,ij->i", half, half))
    half *= np.sinc(angle / np.pi)[:, None]
    a = np.cos(angle)
    b, c, d = half.T
    w, x, y, z = tool_pose[:, 3:].T
    out[:, 3] = a * w - b * x - c * y - d * z
    out[:, 4] = a * x + b * w + c * z - d * y
    out[:, 5] = a * y - b * z + c * w + d * x
    out[:, 6] = a * z + b * y - c * x + d * w
