"""mujoco_warp beside MuJoCo, step by step: where there is no graphics card, on its `cpu` device."""

import numpy as np
import pytest

from shared.errors import ConfigError
from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.sim.batch import FencingBatch
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from shared.sim.worlds import worlds_of

WORLDS = 4
TOLERANCE = {"position": 2e-5, "velocity": 2e-3}
"""rad, m; rad/s, m/s: single precision over 200 steps; contacts are the exception, see below."""


@pytest.fixture(scope="module")
def model() -> FencingModel:
    pytest.importorskip("mujoco_warp", reason="mujoco_warp is not installed (riposte[gpu])")
    return FencingModel.build(SimConfig())


def commands(batch: FencingBatch, generator: np.random.Generator) -> np.ndarray:
    """Return commands a few centimetres and degrees around where the tools begin."""
    wanted = batch.ctrl.reshape(WORLDS, 2, 7).copy()
    wanted[:, :, :3] += generator.uniform(-0.08, 0.08, (WORLDS, 2, 3))
    wanted[:, :, 3:] += generator.normal(size=(WORLDS, 2, 4)) * 0.3
    return wanted.reshape(WORLDS, -1)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_both_simulators_move_alike_where_nothing_touches(model: FencingModel):
    ours, theirs = FencingBatch(model, WORLDS), worlds_of("warp", model, WORLDS, "cpu")
    np.testing.assert_allclose(theirs.sensors, ours.sensors, atol=1e-6)
    generator = np.random.default_rng(3)
    worst = {"position": 0.0, "velocity": 0.0}
    begin = ours.ctrl.copy()
    for step in range(200):
        if step % 20 == 0:
            ours.ctrl[:] = begin
            theirs.ctrl[:] = ours.ctrl[:] = commands(ours, generator)
        ours.step()
        theirs.step()
        bats = np.abs(theirs.sensors - ours.sensors).reshape(WORLDS, 2, 20)
        worst["position"] = max(worst["position"], np.abs(theirs.qpos - ours.qpos).max())
        worst["position"] = max(worst["position"], bats[:, :, :7].max(), bats[:, :, 13:].max())
        worst["velocity"] = max(worst["velocity"], bats[:, :, 7:13].max())
    assert np.abs(ours.qpos - model.en_garde.ravel()).max() > 0.1  # they did move
    assert worst["position"] < TOLERANCE["position"], worst
    assert worst["velocity"] < TOLERANCE["velocity"], worst


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_crossed_blades_press_alike_in_the_first_steps_of_contact(model: FencingModel):
    ours, theirs = FencingBatch(model, 1), worlds_of("warp", model, 1, "cpu")
    middle = np.zeros((2, 7))
    middle[:, :3] = ours.ctrl.reshape(2, 7)[:, :3]
    middle[:, 3:] = ours.ctrl.reshape(2, 7)[:, 3:]
    middle[:, 0] += 0.25  # towards each other, across the target
    middle[:, 1] += 0.2
    touched = 0
    for _ in range(300):
        ours.ctrl[0] = theirs.ctrl[0] = middle.ravel()
        before = ours.qvel.copy()
        ours.step()
        theirs.step()
        gap = np.abs(theirs.qpos - ours.qpos).max()
        jerk = np.abs(ours.qvel - before).max()
        touched += jerk > 1.0
        assert gap < (1e-4 if not touched else 5e-2), (gap, touched)


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_world_is_reset_alone_and_a_state_continues(model: FencingModel):
    worlds = worlds_of("warp", model, WORLDS, "cpu")
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
def test_bouts_are_judged_alike(model: FencingModel):
    rules, action = RuleBook(), ActionConfig()
    ours = FencingEnv(model, rules, action, WORLDS)
    theirs = FencingEnv(
        model, rules, action, WORLDS, worlds=worlds_of("warp", model, WORLDS, "cpu")
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


def test_a_device_that_is_not_there_is_named(model: FencingModel):
    with pytest.raises(ConfigError, match="wants the device 'cuda:7'"):
        worlds_of("warp", model, 1, "cuda:7")


def test_without_mujoco_warp_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(__import__("sys").modules, "mujoco_warp", None)
    with pytest.raises(ConfigError, match=r"riposte\[gpu\]"):
        worlds_of("warp", FencingModel.build(SimConfig()), 1)
