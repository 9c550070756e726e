"""Kernels of our own for worlds on a graphics card; to be imported only where warp is installed."""
# pyright: basic, reportMissingImports=false

import warp as wp

_POSE = wp.constant(7)


@wp.kernel
def take_commands(
    poses: wp.array2d[float],
    moves: wp.array[int],
    goals: wp.array[int],
    ctrl: wp.array2d[float],
    site_quat: wp.array2d[wp.quat],
) -> None:
    """Put a tool's commanded position into its controls, and its orientation into its goal's site.

    Args:
        poses: float32[N, A * 7], positions (m) and quaternions of any length (w, x, y, z).
        moves: int32[A * 3], the controls of each tool's position.
        goals: int32[A], each tool's goal.
        ctrl: float32[N, U], written.
        site_quat: float32[N, S, 4], written: unit quaternions in MuJoCo's order.
    """
    world, agent = wp.tid()
    at = _POSE * agent
    for axis in range(3):
        ctrl[world, moves[3 * agent + axis]] = poses[world, at + axis]
    turn = wp.quat(
        poses[world, at + 3], poses[world, at + 4], poses[world, at + 5], poses[world, at + 6]
    )
    site_quat[world, goals[agent]] = wp.normalize(turn)
