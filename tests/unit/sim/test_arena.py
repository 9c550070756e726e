import subprocess
import sys

import pytest

from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.sim.arena import BASE_YAW, arena_of, bat_of, target_of
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel

SCENES = (SimConfig(), SimConfig(target_height=0.9, target_radius=0.13, control_timestep=0.02))


@pytest.mark.parametrize("cfg", SCENES)
def test_the_place_of_the_game_is_that_of_the_compiled_model(cfg: SimConfig):
    action = ActionConfig(offset_bound_m=0.02)
    env = FencingEnv(FencingModel.build(cfg), RuleBook(), action, 1)
    assert bat_of(cfg) == env.scores.bat
    assert target_of(cfg) == env.scores.target
    assert arena_of(cfg, action) == env.arena
    assert env.model.base_yaw == BASE_YAW


@pytest.mark.parametrize("service", ["policy", "referee"])
def test_who_plays_or_judges_live_loads_no_physics_and_no_learning(service: str):
    code = (
        f"import sys; import services.{service}.__main__; import shared.bus.zenoh; "
        "heavy = {'mujoco', 'torch', 'rerun', 'scipy', 'sklearn'} & set(sys.modules); "
        "assert not heavy, heavy"
    )
    done = subprocess.run(
        [sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
