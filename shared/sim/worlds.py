"""What steps many worlds, whichever simulator does it, and how one is chosen."""

from collections.abc import Callable
from typing import Literal, Protocol

from shared.sim.arm import Float64
from shared.sim.batch import FencingBatch, Float32, Int64
from shared.sim.model import FencingModel

Backend = Literal["cpu", "warp"]


class Worlds(Protocol):
    """Many fencing worlds; shapes and units are those of :class:`FencingBatch`."""

    sensors: Float64
    ctrl: Float64
    qpos: Float64
    qvel: Float64
    step: Callable[[], None]

    def others(self, num_envs: int) -> "Worlds":
        """Return so many other worlds of the same model, on the same device, all en garde."""
        ...

    def reset(self, ids: Int64, qpos: Float64) -> None:
        """Put worlds at rest in a posture, each tool commanded to stay where it is."""
        ...

    def body_poses(self, world: int) -> tuple[Float32, Float32]:
        """Return the poses of one world's bodies."""
        ...

    def state(self) -> Float64:
        """Return float64[N, S], everything a continuation needs."""
        ...

    def restore(self, state: Float64) -> None:
        """Continue from what :meth:`state` returned."""
        ...

    def check(self) -> None:
        """Make sure that every world is still finite."""
        ...


def worlds_of(backend: Backend, model: FencingModel, num_envs: int, device: str = "") -> Worlds:
    """Return worlds of a model, all en garde.

    Args:
        backend: ``cpu`` is MuJoCo itself, ``warp`` is mujoco_warp on a graphics card.
        model: the scene.
        num_envs: how many worlds.
        device: of ``warp``: ``cuda:0``, ``cpu`` (slow: for tests); empty takes the first card.

    Raises:
        ConfigError: mujoco_warp is not installed, or there is no such device.
    """
    if backend == "cpu":
        return FencingBatch(model, num_envs)
    from shared.sim.warp_batch import WarpBatch

    return WarpBatch(model, num_envs, device)
