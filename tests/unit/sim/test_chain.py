import mujoco
import numpy as np
import pytest

from shared.sim.chain import Link, chain_of
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel


def rotation(quaternion: tuple[float, ...]) -> np.ndarray:
    w, x, y, z = quaternion
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def placed(links: tuple[Link, ...], angles: np.ndarray) -> np.ndarray:
    """Return float64[B, 3]: where the bodies are, link by link."""
    places: list[np.ndarray] = []
    turns: list[np.ndarray] = []
    for link in links:
        turn = rotation(link.quaternion)
        if link.axis is not None:
            half = 0.5 * angles[link.joint]
            turn = turn @ rotation((np.cos(half), *(np.sin(half) * np.array(link.axis))))
        if link.parent < 0:
            places.append(np.array(link.position))
            turns.append(turn)
        else:
            places.append(places[link.parent] + turns[link.parent] @ np.array(link.position))
            turns.append(turns[link.parent] @ turn)
    return np.array(places)


@pytest.mark.parametrize("arms", [("right", "right"), ("left", "right")])
def test_the_chain_puts_every_body_where_the_simulator_does(arms: tuple[str, str]):
    model = FencingModel.build(SimConfig(arms=arms))  # type: ignore[arg-type]
    links = chain_of(model)
    assert tuple(link.name for link in links) == model.body_names
    assert [link.joint for link in links if link.axis is not None] == list(range(14))
    data = mujoco.MjData(model.mj)
    for seed in range(5):
        data.qpos[:] = np.random.default_rng(seed).uniform(-2.0, 2.0, 14)
        mujoco.mj_kinematics(model.mj, data)
        assert placed(links, data.qpos) == pytest.approx(data.xpos, abs=1e-9)
