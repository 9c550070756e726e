from pathlib import Path

import pytest

from services.actor.joining import is_joining, merged
from services.league.settings import run_settings
from shared.config.site import load_section
from shared.errors import ConfigError
from shared.game.rules import RuleBook
from shared.messages.league import RunSettings
from shared.sim.config import SimConfig

SITE = """
[bus]
listen = ["tcp/127.0.0.1:7447"]
[sim]
half_distance = 1.1
[game]
bout_steps = 400
[actor]
num_envs = 128
rollout_steps = 40
[league]
seed = 3
"""


def test_an_actor_joins_where_its_command_line_names_no_folder_of_a_run():
    assert is_joining(["--connect", "tcp/127.0.0.1:7447"])
    assert is_joining(["site.toml", "--run-id", "demo", "--name", "a"])
    assert not is_joining(["--run", "runs/demo", "--run-id", "demo"])
    assert not is_joining(["--run=runs/demo"])


def test_the_league_tells_what_actors_must_have_the_same_of_and_nothing_else(tmp_path: Path):
    site = tmp_path / "site.toml"
    site.write_text(SITE)
    told = run_settings(site, ("game.bout_steps=80", "learner.gamma=0.9"))
    assert "[bus]" not in told.toml
    assert "[league]" not in told.toml
    joined = tmp_path / "joined.toml"
    joined.write_text(told.toml)
    assert load_section(joined, "game", RuleBook) == RuleBook(bout_steps=80)
    assert load_section(joined, "sim", SimConfig) == SimConfig(half_distance=1.1)
    assert run_settings(None, ()) == RunSettings(toml="")


def test_a_run_on_a_model_of_its_own_sends_the_model(tmp_path: Path):
    model = tmp_path / "ours.toml"
    model.write_text("name = 'ours'\n")
    told = run_settings(None, (f'sim.model="{model}"',))
    assert told.model == "name = 'ours'\n"
    tables = merged(told, {}, tmp_path / "scratch" / "model.toml")
    assert tables["sim"]["model"] == str(tmp_path / "scratch" / "model.toml")
    model.unlink()
    with pytest.raises(ConfigError, match="cannot read the model"):
        run_settings(None, (f'sim.model="{model}"',))


def test_of_its_own_site_an_actor_keeps_what_may_differ(tmp_path: Path):
    told = RunSettings(toml="[game]\nbout_steps = 80\n[actor]\nnum_envs = 128\nrollout_steps = 20")
    own = {
        "bus": {"give_up_seconds": 99.0},
        "sim": {"half_distance": 1.9},
        "actor": {"num_envs": 8},
    }
    assert merged(told, own, None) == {
        "bus": {"give_up_seconds": 99.0},
        "game": {"bout_steps": 80},
        "actor": {"num_envs": 8, "rollout_steps": 20},
    }


@pytest.mark.parametrize(
    "text", ["[bus]\nlisten = []", "sim = 3", "[[sim]]\nmodel = 'x'", "no toml", "[safety]\nx = 1"]
)
def test_a_league_that_says_anything_else_is_not_followed(text: str):
    with pytest.raises(ConfigError, match="settings of the run"):
        merged(RunSettings(toml=text), {}, None)
