from pathlib import Path

import pytest

from services.actor import joining
from services.jobs.up import SiteConfig, specs


def test_each_process_gets_a_name_of_its_own_and_the_same_run(tmp_path: Path):
    cfg = SiteConfig(processes=("router", "learner antagonist", "actor", "actor"))
    site = tmp_path / "s.toml"
    made = specs(cfg, site=site, run=tmp_path, run_id="r", node="n1-", overrides=["a.b=1"])
    assert [spec.name for spec in made] == [
        "n1-router-0", "n1-learner-antagonist", "n1-actor-0", "n1-actor-1",
    ]  # fmt: skip
    assert "--agent antagonist" in " ".join(made[1].argv)
    for spec in made:
        assert str(site) in spec.argv
        assert spec.argv[-2:] == ("--set", "a.b=1")


def test_actors_join_where_the_league_is_on_another_machine(tmp_path: Path):
    site = tmp_path / "s.toml"
    cfg = SiteConfig(processes=("actor", "actor"))
    alone = specs(cfg, site=site, run=tmp_path, run_id="x", node="", overrides=["a.b=1"])
    assert [spec.name for spec in alone] == ["actor-0", "actor-1"]
    for spec in alone:
        assert joining.is_joining(spec.argv[4:])
        assert spec.argv[4:] == (str(site), "--set", "a.b=1")
    named = specs(cfg, site=site, run=tmp_path, run_id="r", node="n1-", overrides=[], join="r")
    assert named[1].argv[4:] == (str(site), "--name", "n1-actor-1", "--run-id", "r")
    with_league = SiteConfig(processes=("league", "actor"))
    made = specs(with_league, site=site, run=tmp_path, run_id="r", node="", overrides=[])
    assert not joining.is_joining(made[1].argv[4:])


def test_a_live_bout_is_a_site_of_its_own(tmp_path: Path):
    cfg = SiteConfig(processes=("router", "referee", "policy antagonist", "policy protagonist"))
    made = specs(cfg, site=tmp_path / "s.toml", run=tmp_path, run_id="r", node="", overrides=[])
    assert [spec.name for spec in made][1:] == [
        "referee-0", "policy-antagonist", "policy-protagonist",
    ]  # fmt: skip
    assert "services.policy" in made[3].argv
    assert made[3].argv[made[3].argv.index("--agent") + 1] == "protagonist"


def test_the_process_that_moves_a_robot_is_a_role(tmp_path: Path):
    cfg = SiteConfig(processes=("router", "robot-io"))
    made = specs(cfg, site=tmp_path / "s.toml", run=tmp_path, run_id="r", node="", overrides=[])
    assert made[1].name == "robot-io-0"
    assert "services.robot_io" in made[1].argv


@pytest.mark.parametrize(
    ("processes", "message"),
    [
        ((), "processes is empty"),
        (("actr",), "processes has 'actr'; did you mean 'actor'?"),
        (("learner",), "expected 'learner antagonist'"),
        (("actor antagonist",), "expected 'learner antagonist'"),
        (("referee", "policy"), "has 'policy', expected 'policy antagonist'"),
    ],
)
def test_a_role_that_is_none_is_refused(processes: tuple[str, ...], message: str):
    with pytest.raises(ValueError) as caught:  # noqa: PT011
        SiteConfig(processes=processes)
    assert message in str(caught.value)
