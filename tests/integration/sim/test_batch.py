from pathlib import Path

import msgspec
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from shared.errors import SimulationError
from shared.sim.batch import FencingBatch
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.nan_guard import DEPTH
from shared.sim.parameters import CommandParameters, load_parameters

Float64 = NDArray[np.float64]
NOMINAL = load_parameters("nominal")
LAGGING = msgspec.structs.replace(NOMINAL, command=CommandParameters(filter=0.05, delay=0.0075))
DIRECT_MODEL = FencingModel.build(SimConfig())
MODELS = {
    "direct": DIRECT_MODEL,
    "two substeps": FencingModel.build(SimConfig(physics_timestep=0.005)),
    "filter and delay": FencingModel.of(SimConfig(physics_timestep=0.005), LAGGING),
}


def play(batch: FencingBatch, steps: int, seed: int) -> Float64:
    """Drive every world about, resetting some; return the sensors of every step."""
    rng = np.random.default_rng(seed)
    seen = []
    for step in range(steps):
        for agent in range(2):
            tool = batch.sensors[:, 20 * agent + 13 : 20 * agent + 20]
            move = rng.uniform(-0.1, 0.1, tool.shape)
            batch.ctrl[:, 7 * agent : 7 * agent + 7] = tool + move
        batch.step()
        seen.append(batch.sensors.copy())
        if step % 25 == 24:
            ids = rng.choice(batch.num_envs, 3, replace=False)
            noise = rng.uniform(-0.1, 0.1, (3, 14))
            batch.reset(ids, batch.model.en_garde.ravel() + noise)
    batch.check()
    return np.array(seen)


@pytest.mark.parametrize("name", MODELS)
def test_two_threads_give_the_bits_of_one(name: str):
    one, two = (play(FencingBatch(MODELS[name], 9, threads), 60, 1) for threads in (1, 2))
    assert (one == two).all()


@pytest.mark.parametrize("name", MODELS)
def test_a_restored_batch_goes_on_bit_for_bit(name: str):
    first, second = FencingBatch(MODELS[name], 8), FencingBatch(MODELS[name], 8)
    play(first, 40, 2)
    state = first.state()
    play(second, 13, 3)
    second.restore(state)
    assert (first.sensors == second.sensors).all()
    assert (first.ctrl == second.ctrl).all()
    assert (play(first, 40, 4) == play(second, 40, 4)).all()
    assert (first.state() == second.state()).all()


def test_a_batch_is_plain_mujoco_bit_for_bit():
    batch = FencingBatch(DIRECT_MODEL, 2)
    data = mujoco.MjData(DIRECT_MODEL.mj)
    data.qpos[:] = DIRECT_MODEL.en_garde.ravel()
    rng = np.random.default_rng(5)
    for _ in range(100):
        batch.ctrl[:] = batch.ctrl + rng.uniform(-0.02, 0.02, 14)
        data.ctrl[:] = batch.ctrl[1]
        mujoco.mj_step(DIRECT_MODEL.mj, data)
        batch.step()
    assert (batch.qpos[1] == data.qpos).all()


def test_sensors_are_current_after_a_step_and_after_a_reset():
    batch = FencingBatch(DIRECT_MODEL, 3)
    data = mujoco.MjData(DIRECT_MODEL.mj)
    batch.ctrl[:] += 0.05
    for _ in range(5):
        batch.step()
    batch.reset(np.array([1]), DIRECT_MODEL.en_garde.reshape(1, 14) + 0.05)
    for world in range(3):
        data.qpos[:], data.qvel[:] = batch.qpos[world], batch.qvel[world]
        mujoco.mj_forward(DIRECT_MODEL.mj, data)
        assert batch.sensors[world] == pytest.approx(data.sensordata, abs=1e-12)


def test_a_reset_leaves_the_other_worlds_alone_and_holds_its_own():
    batch = FencingBatch(DIRECT_MODEL, 4)
    batch.ctrl[:] += 0.05
    for _ in range(5):
        batch.step()
    before = batch.state()
    batch.reset(np.array([2]), DIRECT_MODEL.en_garde.reshape(1, 14))
    others = [0, 1, 3]
    assert (batch.state()[others] == before[others]).all()
    for _ in range(20):
        batch.step()
    assert batch.qpos[2] == pytest.approx(DIRECT_MODEL.en_garde.ravel(), abs=1e-9)
    batch.reset(np.array([], np.int64), np.zeros((0, 14)))


def test_a_delayed_and_filtered_command_moves_the_arm_later():
    moved = {}
    for name in ("two substeps", "filter and delay"):
        batch = FencingBatch(MODELS[name], 1)
        start = batch.sensors[0, 13:16].copy()
        batch.ctrl[0, 0] += 0.05
        moved[name] = []
        for _ in range(100):
            batch.step()
            moved[name].append(float(np.linalg.norm(batch.sensors[0, 13:16] - start)))
    assert moved["filter and delay"][2] < 0.4 * moved["two substeps"][2]
    assert moved["filter and delay"][-1] == pytest.approx(moved["two substeps"][-1], abs=2e-3)


def test_body_poses_are_those_of_the_scene():
    batch = FencingBatch(DIRECT_MODEL, 2)
    batch.ctrl[1] += 0.05
    for _ in range(10):
        batch.step()
    positions, quaternions = batch.body_poses(1)
    data = mujoco.MjData(DIRECT_MODEL.scene)
    data.qpos[:] = batch.qpos[1]
    mujoco.mj_kinematics(DIRECT_MODEL.scene, data)
    assert positions.dtype == quaternions.dtype == np.float32
    assert positions == pytest.approx(data.xpos, abs=1e-6)
    assert quaternions == pytest.approx(data.xquat, abs=1e-6)
    assert len(positions) == len(DIRECT_MODEL.body_names)


@pytest.mark.parametrize("name", MODELS)
def test_a_world_that_diverges_leaves_its_last_states_behind(name: str, tmp_path: Path):
    batch = FencingBatch(MODELS[name], 5, dump_folder=tmp_path)
    seen = []
    rng = np.random.default_rng(6)
    for step in range(160):
        batch.ctrl[:] += rng.uniform(-0.01, 0.01, batch.ctrl.shape)
        seen.append(batch.qpos[3].copy())
        batch.step()
        if step == 20:
            batch.reset(np.array([1, 3]), np.tile(batch.model.en_garde.ravel(), (2, 1)))
    batch.check()
    batch.qvel[3, 2] = np.inf
    with pytest.raises(SimulationError, match="world 3 of 5 diverged") as caught:
        batch.check()
    (dump,) = tmp_path.glob("*.npz")
    assert str(dump) in str(caught.value)
    assert "\n" not in str(caught.value)
    with np.load(dump) as states:
        calls = 2 if name == "filter and delay" else 1
        assert (states["qpos"][:-1][::calls] == seen[-DEPTH // calls :]).all()
        assert np.isinf(states["qvel"][-1, 2])
        assert states["ctrl"].shape == (DEPTH + 1, 14)
    assert mujoco.MjModel.from_xml_path(str(dump.with_suffix(".xml"))).nq == 14


def test_a_command_that_is_not_a_number_is_found(tmp_path: Path):
    batch = FencingBatch(DIRECT_MODEL, 3, dump_folder=tmp_path)
    batch.step()
    batch.ctrl[2, 0] = np.nan
    batch.step()
    with pytest.raises(SimulationError, match=r"world 2 of 3 diverged \(.*BADCTRL"):
        batch.check()


def test_nothing_is_written_where_the_process_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.chdir(tmp_path)
    batch = FencingBatch(DIRECT_MODEL, 1, dump_folder=tmp_path / "dumps")
    batch.qvel[0, 0] = np.nan
    batch.step()
    assert list(tmp_path.iterdir()) == []


def test_a_state_of_another_shape_is_refused():
    with pytest.raises(ValueError, match="needs a state of shape"):
        FencingBatch(DIRECT_MODEL, 2).restore(np.zeros((2, 3)))
    with pytest.raises(ValueError, match="must be at least 1"):
        FencingBatch(DIRECT_MODEL, 0)
