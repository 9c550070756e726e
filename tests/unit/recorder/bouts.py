"""Makes bouts to show: plausible poses without any physics."""

import numpy as np

from shared.messages.live import BoutFrames
from shared.sim.model import FencingModel


def frames(
    model: FencingModel,
    steps: list[int],
    bout: int = 0,
    *,
    actor: str = "actor-0",
    contact: list[int] | None = None,
    model_hash: str = "",
    bodies: int = 0,
) -> BoutFrames:
    """Return instants of a bout; every body moves but torsos and world."""
    count, bodies = len(steps), bodies or len(model.body_names)
    time = np.asarray(steps, np.float32)
    still = [b for b, name in enumerate(model.body_names) if name.endswith(("world", "torso"))]
    positions = np.zeros((count, bodies, 3), np.float32)
    positions[:, :, 0] = np.arange(bodies)
    positions[:, :, 2] = time[:, None] / 1000.0
    positions[:, [b for b in still if b < bodies], 2] = 1.0
    quaternions = np.zeros((count, bodies, 4), np.float32)
    quaternions[..., 0] = 1.0
    return BoutFrames(
        actor=actor,
        lease="lease-1",
        bout=bout,
        antagonist="sha256:" + "ab" * 32,
        protagonist="scripted:static",
        model=model_hash or model.hash,
        steps=np.asarray(steps, np.int32),
        positions=positions,
        quaternions=quaternions,
        joints=np.repeat(time[:, None, None], 14, axis=1).reshape(count, 2, 7) / 100.0,
        score=time,
        in_target=np.stack([time > 20, time > 1000], axis=1),
        contact=np.isin(time, contact or []),
    )
