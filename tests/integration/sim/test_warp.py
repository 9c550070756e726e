"""mujoco_warp beside MuJoCo, step by step: where there is no graphics card, on its `cpu` device."""

from collections.abc import Iterator

import msgspec
import mujoco
import numpy as np
import pytest

from shared.errors import ConfigError, SimulationError
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.sim.batch import FencingBatch
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from shared.sim.parameters import load_parameters
from shared.sim.worlds import Worlds, worlds_of

WORLDS = 4
TOLERANCE = {"position": 2e-5, "velocity": 2e-3}
"""rad, m; rad/s, m/s: single precision over 200 steps, where nothing touches."""


@pytest.fixture(scope="module")
def model() -> FencingModel:
    pytest.importorskip("mujoco_warp", reason="mujoco_warp is not installed (riposte[gpu])")
    return FencingModel.build(SimConfig())


@pytest.fixture(scope="module")
def device(model: FencingModel) -> str:
    warp = pytest.importorskip("warp")
    warp.init()
    return "cuda:0" if warp.get_cuda_device_count() else "cpu"


def commands(batch: FencingBatch, generator: np.random.Generator) -> np.ndarray:
    """Return commands a few centimetres and degrees around where the tools begin."""
    worlds = batch.num_envs
    wanted = batch.ctrl.reshape(worlds, 2, 7).copy()
    wanted[:, :, :3] += generator.uniform(-0.08, 0.08, (worlds, 2, 3))
    wanted[:, :, 3:] += generator.normal(size=(worlds, 2, 4)) * 0.3
    return wanted.reshape(worlds, -1)


def driven(
    ours: FencingBatch, theirs: Worlds, steps: int, hold: int, generator: np.random.Generator
) -> Iterator[None]:
    """Step both by the same commands, new ones every so many steps; stop after each step."""
    begin = ours.ctrl.copy()
    for step in range(steps):
        if step % hold == 0:
            ours.ctrl[:] = begin
            theirs.ctrl[:] = ours.ctrl[:] = commands(ours, generator)
        ours.step()
        theirs.step()
        yield


def crossed(worlds: Worlds) -> np.ndarray:
    """Return commands at which the blades of one world press against each other."""
    wanted = worlds.ctrl.reshape(2, 7).copy()
    wanted[:, 0] += 0.4  # towards each other, across the target
    wanted[:, 1] += 0.2
    return wanted.ravel()


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_both_simulators_move_alike_where_nothing_touches(model: FencingModel, device: str):
    ours, theirs = FencingBatch(model, WORLDS), worlds_of("warp", model, WORLDS, device)
    np.testing.assert_allclose(theirs.sensors, ours.sensors, atol=1e-6)
    generator = np.random.default_rng(3)
    worst = {"position": 0.0, "velocity": 0.0}
    for _ in driven(ours, theirs, 200, 20, generator):
        bats = np.abs(theirs.sensors - ours.sensors).reshape(WORLDS, 2, 20)
        worst["position"] = max(worst["position"], np.abs(theirs.qpos - ours.qpos).max())
        worst["position"] = max(worst["position"], bats[:, :, :7].max(), bats[:, :, 13:].max())
        worst["velocity"] = max(worst["velocity"], bats[:, :, 7:13].max())
    assert np.abs(ours.qpos - model.en_garde.ravel()).max() > 0.1  # they did move
    assert worst["position"] < TOLERANCE["position"], worst
    assert worst["velocity"] < TOLERANCE["velocity"], worst


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_blades_that_meet_press_alike(model: FencingModel, device: str):
    ours, theirs = FencingBatch(model, 1), worlds_of("warp", model, 1, device)
    theirs.ctrl[0] = ours.ctrl[0] = crossed(ours)
    data = mujoco.MjData(model.mj)
    touched = 0
    for _ in range(300):
        ours.step()
        theirs.step()
        data.qpos[:] = ours.qpos[0]
        mujoco.mj_forward(model.mj, data)
        touched += data.ncon > 0
        assert np.abs(theirs.qpos - ours.qpos).max() < 1e-4, touched
    assert touched > 100  # they met, and pressed


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_world_is_reset_alone_and_a_state_continues(model: FencingModel, device: str):
    worlds = worlds_of("warp", model, WORLDS, device)
    generator = np.random.default_rng(1)
    for _ in range(5):
        worlds.ctrl[:] += generator.normal(size=worlds.ctrl.shape) * 0.01
        worlds.step()
    kept = worlds.state()
    moved = worlds.qpos.copy()
    worlds.reset(np.array([2]), model.en_garde.reshape(1, -1))
    np.testing.assert_allclose(worlds.qpos[2], model.en_garde.ravel(), atol=1e-6)
    np.testing.assert_array_equal(worlds.qpos[[0, 1, 3]], moved[[0, 1, 3]])
    worlds.restore(kept)
    np.testing.assert_array_equal(worlds.qpos, moved)
    worlds.step()
    once = worlds.qpos.copy()
    worlds.restore(kept)
    worlds.step()
    np.testing.assert_array_equal(worlds.qpos, once)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_other_bouts_have_worlds_of_their_own_where_these_are(model: FencingModel, device: str):
    worlds = worlds_of("warp", model, WORLDS, device)
    env = FencingEnv(model, RuleBook(), ActionConfig(), WORLDS, worlds=worlds)
    others = env.others(1)
    assert type(others.batch) is type(worlds)
    assert others.batch.qpos.shape == (1, 14)
    stood = worlds.qpos.copy()
    others.batch.ctrl += 0.01
    for _ in range(5):
        others.batch.step()
    assert np.abs(others.batch.qpos - stood[:1]).max() > 1e-4
    np.testing.assert_array_equal(worlds.qpos, stood)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_bouts_are_judged_alike(model: FencingModel, device: str):
    rules, action = RuleBook(), ActionConfig()
    ours = FencingEnv(model, rules, action, WORLDS)
    theirs = FencingEnv(
        model, rules, action, WORLDS, worlds=worlds_of("warp", model, WORLDS, device)
    )
    for env in (ours, theirs):
        env.reset(np.arange(WORLDS), np.random.default_rng(0))
    generator = np.random.default_rng(4)
    alike = 0
    for _ in range(100):
        moves = generator.uniform(-1.0, 1.0, (2, WORLDS, 6)).astype(np.float32)
        one, other = ours.step(*moves), theirs.step(*moves)
        alike += bool((one.antagonist_in_target == other.antagonist_in_target).all())
    assert alike >= 98
    np.testing.assert_allclose(ours.scores.score, theirs.scores.score, atol=12.0)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_control_step_of_several_physics_steps_is_the_same(device: str):
    nominal = load_parameters("nominal")
    late = msgspec.structs.replace(nominal.command, delay=0.013)
    parameters = msgspec.structs.replace(nominal, command=late)
    model = FencingModel.of(SimConfig(physics_timestep=0.0025), parameters)
    ours, theirs = FencingBatch(model, WORLDS), worlds_of("warp", model, WORLDS, device)
    generator = np.random.default_rng(5)
    for _ in driven(ours, theirs, 60, 10, generator):
        pass
    np.testing.assert_allclose(theirs.qpos, ours.qpos, atol=TOLERANCE["position"])


@pytest.mark.gpu
@pytest.mark.timeout(1200)
def test_thousands_of_worlds_on_a_card_each_move_as_mujoco_has_them(
    model: FencingModel, device: str
):
    if device == "cpu":
        pytest.skip("no graphics card")
    ours, theirs = FencingBatch(model, 4096), worlds_of("warp", model, 4096, device)
    generator = np.random.default_rng(6)
    for _ in range(3):
        theirs.ctrl[:] = ours.ctrl[:] = commands(ours, generator)
        for _ in range(20):
            ours.step()
            theirs.step()
    gaps = np.abs(theirs.qpos - ours.qpos).max(axis=1)
    apart = np.median(gaps), np.quantile(gaps, 0.99)  # in the last 1 % bats have met
    assert apart[0] < TOLERANCE["position"], apart
    assert apart[1] < 100 * TOLERANCE["position"], apart
    theirs.check()


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_contacts_that_there_is_no_room_for_are_told(
    model: FencingModel, device: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("shared.sim.warp_batch._most", lambda mj: (1, 1))
    worlds = worlds_of("warp", model, 1, device)
    worlds.check()
    worlds.ctrl[0] = crossed(worlds)
    for _ in range(100):
        worlds.step()
    with pytest.raises(SimulationError, match="more contacts than there is room for, world 0"):
        worlds.check()


def test_a_device_that_is_not_there_is_named(model: FencingModel):
    with pytest.raises(ConfigError, match="wants the device 'cuda:7'"):
        worlds_of("warp", model, 1, "cuda:7")


def test_without_mujoco_warp_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco_warp", None)
    with pytest.raises(ConfigError, match=r"riposte\[gpu\]"):
        worlds_of("warp", FencingModel.build(SimConfig()), 1)
