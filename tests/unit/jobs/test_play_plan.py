"""What `riposte play` reads before it starts anything, and what it refuses, in one line."""

import contextlib
import os
import socket
import tomllib
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from services import cli
from services.jobs.play import plan as play_plan
from services.jobs.play import seats as play_seats
from services.jobs.play.plan import LAPTOP, parse, plan_of
from services.jobs.site import section_types
from services.robot_io.config import RobotIoConfig, SafetyConfig
from shared.config.site import load_section, load_site
from shared.errors import SnapshotError
from shared.runtime.logging import configure_logging
from shared.styles.bundle import load_bundle, shipped_bundle
from tests.unit.policy.making import snapshot

OURS = snapshot(1, agent="protagonist", policy_version=3)
NEWER = snapshot(2, agent="protagonist", policy_version=9)
THEIRS = snapshot(3, agent="antagonist", policy_version=4)
DEPLOY = Path(__file__).resolve().parents[3] / "deploy"


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.chdir(tmp_path)
    yield
    configure_logging(None)


def planned(*words: str) -> tuple[play_plan.Plan, dict[str, dict]]:
    plan = plan_of(parse(words))
    return plan, tomllib.loads(plan.settings)


def a_run(name: str, *snapshots) -> Path:
    folder = Path(name) / "snapshots"
    folder.mkdir(parents=True)
    for made in snapshots:
        (folder / f"{made.digest}.safetensors").write_bytes(made.payload)
    return Path(name)


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    assert cli.main(["play", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1, err
    assert not list(Path().rglob("config.toml"))
    return err


# -- what is played ---------------------------------------------------------------------------


def test_without_arguments_a_person_with_a_mouse_meets_the_first_selected_style():
    plan, settings = planned()
    style = load_bundle(shipped_bundle()).bundle.players[1]
    assert style.role == "selected"
    assert (plan.antagonist.label, plan.antagonist.reference) == ("mouse", "person")
    assert (plan.protagonist.label, plan.protagonist.reference) == (style.name, style.reference)
    assert plan.has_page
    assert not plan.is_armed_by_typing
    assert not plan.starts_bouts
    assert plan.bouts == 0
    assert settings["robot_io"]["tracker"] == "mouse"
    assert settings["page"]["pointer"] is True
    assert settings["page"]["antagonist"] == "person"
    names = [name for name, _ in settings["page"]["players"]]
    assert names == [
        "style-1", "warm-start", "style-2", "style-3",
        "Heuristic", "Heuristic, not camping", "Guard",
    ]  # fmt: skip
    assert settings["page"]["players"][0][1] == settings["policy"]["protagonist"]
    assert str(plan.folder).startswith("runs/play-")
    assert not plan.folder.exists()


def test_two_policies_need_no_page_and_start_by_themselves():
    plan, settings = planned("--antagonist", "heuristic", "--protagonist", "heuristic")
    assert plan.antagonist.reference == "scripted:stab"
    assert plan.protagonist.reference == "scripted:heuristic"
    assert not plan.has_page
    assert plan.starts_bouts
    assert plan.is_armed_by_typing
    assert settings["robot_io"]["tracker"] == "policy"
    assert settings["policy"]["antagonist"] == "scripted:stab"


def test_the_newest_of_a_run_is_pinned_to_its_file():
    run = a_run("runs/a", OURS, NEWER, THEIRS)
    plan, settings = planned(
        "--protagonist", f"{run}:protagonist", "--antagonist", f"{run}:antagonist"
    )
    file = (run / "snapshots" / f"{NEWER.digest}.safetensors").resolve()
    assert settings["policy"]["protagonist"] == str(file)
    assert plan.protagonist.reference == NEWER.reference
    assert plan.antagonist.reference == THEIRS.reference


def test_a_hash_is_found_in_any_run_and_in_the_bundle():
    a_run("runs/a", THEIRS)
    a_run("runs/b", OURS)
    plan, settings = planned("--protagonist", OURS.reference)
    assert plan.protagonist.label == OURS.reference[:19]
    assert Path(settings["policy"]["protagonist"]).is_file()
    style = load_bundle(shipped_bundle()).bundle.player("style-3")
    assert planned("--protagonist", style.reference)[0].protagonist.reference == style.reference


def test_a_file_and_a_name_of_the_bundle_are_players_too():
    Path("x.safetensors").write_bytes(OURS.payload)
    plan, settings = planned("--protagonist", "x.safetensors")
    assert plan.protagonist.reference == OURS.reference
    assert settings["policy"]["protagonist"] == str(Path("x.safetensors").resolve())
    assert planned("--protagonist", "warm-start")[0].protagonist.label == "warm-start"


def test_flags_stand_over_the_site_file_and_its_other_values_stay():
    Path("s.toml").write_text(
        '[play]\nbouts = 7\nprotagonist = "heuristic"\n[game]\nbout_steps = 500\n'
    )
    plan, settings = planned("s.toml", "--antagonist", "scripted:slash", "--set", "play.rest=1.5")
    assert (plan.bouts, plan.play.rest) == (7, 1.5)
    assert plan.protagonist.reference == "scripted:heuristic"
    assert settings["game"]["bout_steps"] == 500
    assert settings["robot_io"]["twin_filter"] == RobotIoConfig().twin_filter
    assert planned("s.toml", "--bouts", "2")[0].bouts == 2


def test_a_real_robot_is_armed_by_nobody_s_typing():
    Path("s.toml").write_text('[robot_io]\nlink = "pr2"\ntracker = "vive"\n[play]\nbouts = 3\n')
    plan, settings = planned("s.toml")
    assert not plan.is_armed_by_typing
    assert plan.starts_bouts
    assert plan.has_page
    assert settings["robot_io"]["tracker"] == "vive"
    assert settings["page"]["pointer"] is False
    assert not planned("s.toml", "--bouts", "0")[0].starts_bouts


def test_a_page_port_in_use_is_replaced_unless_it_was_chosen(capsys: pytest.CaptureFixture[str]):
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as other:
        port = other.getsockname()[1]
        line = refused(capsys, "--port", str(port))
        assert f"page.port: {port} is in use by another program" in line
        assert "in use" in refused(capsys, "--set", f"page.port={port}")
        assert planned("--port", str(port), "--antagonist", "heuristic")[0]  # no page, no port


def test_the_default_page_port_gives_way(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(play_plan, "free_port", lambda wanted: wanted + 1)
    assert planned()[1]["page"]["port"] == 8766


# -- the simulated robot of a laptop ----------------------------------------------------------


def test_the_laptops_site_file_says_what_no_site_file_means():
    _, without = planned()
    _, with_file = planned(str(DEPLOY / "play.toml"))
    for section in ("robot_io", "safety", "sim", "game", "action"):
        assert with_file[section] == without[section]
    assert without["robot_io"]["twin_filter"] == 1.0
    assert without["safety"]["game_speed"] == 1.0


def test_the_laptops_limits_are_never_those_of_a_real_robot(capsys: pytest.CaptureFixture[str]):
    for section, default in (("robot_io", RobotIoConfig()), ("safety", SafetyConfig())):
        laptop = load_section(None, section, type(default), LAPTOP)
        for override in LAPTOP:
            where, _, key = override.partition("=")[0].partition(".")
            if where == section:
                assert getattr(laptop, key) != getattr(default, key)
    line = refused(capsys, "--set", 'robot_io.link="pr2"', "--antagonist", "vive")
    assert "a real robot: its limits stand in a site file" in line


def test_the_site_file_of_a_real_robot_is_played_with_the_default_limits():
    plan, settings = planned(str(DEPLOY / "robot.toml"))
    assert (plan.link, plan.antagonist.label) == ("pr2", "vive")
    assert not plan.is_armed_by_typing
    assert not plan.starts_bouts
    assert planned(str(DEPLOY / "robot.toml"), "--bouts", "20")[0].starts_bouts
    limits = msgspec.convert(settings["safety"], SafetyConfig)
    assert limits == SafetyConfig()
    for name in ("play.toml", "robot.toml"):
        assert load_site(DEPLOY / name, section_types())


# -- refusals ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--protagonist", "style-9"), "there is no player 'style-9': say heuristic"),
        (("--protagonist", "scripted:heuristc"), "there is no player 'scripted:heuristc'"),
        (("--antagonist", "nobody.safetensors"), "cannot be read (No such file"),
        (("--protagonist", "runs/none:protagonist"), "holds no snapshot of the protagonist"),
        (("--protagonist", f"sha256:{'0' * 64}"), "no run in runs holds snapshot 000000000000"),
        (("--protagonist", "sha256:123"), "expected sha256:<64 hex digits>"),
        (("--bouts", "-1"), "bouts (-1) must be in 0 .. 10000"),
        (("nowhere.toml",), "cannot read site file nowhere.toml"),
        (("--set", "play.bout=3"), "did you mean 'bouts'?"),
        (("--set", "safety.game_speed=1.5"), "game_speed is 1.5; allowed are"),
        (("--set", "robot_io.link=pr3"), "robot_io"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(
    capsys: pytest.CaptureFixture[str], words: tuple[str, ...], expected: str
):
    assert expected in refused(capsys, *words)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"observation_schema": "0" * 16}, "its observation_schema is"),
        ({"action_schema": "1" * 16}, "its action_schema is"),
        ({"control_timestep": 0.02}, "its control_timestep is"),
        ({"offset_bound_m": 0.1}, "its offset_bound_m is"),
        ({"agent": "antagonist"}, "its agent is antagonist, this process plays the protagonist"),
    ],
)
def test_a_snapshot_that_does_not_fit_is_refused_by_its_field(
    capsys: pytest.CaptureFixture[str], change: dict, field: str
):
    made = snapshot(5, **{"agent": "protagonist", **change})
    Path("x.safetensors").write_bytes(made.payload)
    line = refused(capsys, "--protagonist", "x.safetensors")
    assert line.startswith("riposte: play: protagonist: snapshot")
    assert field in line


def test_a_damaged_snapshot_is_refused(capsys: pytest.CaptureFixture[str]):
    Path("x.safetensors").write_bytes(OURS.payload[:-5])
    assert "protagonist" in refused(capsys, "--protagonist", "x.safetensors")


def test_an_installation_without_a_bundle_says_what_to_do(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    def none() -> Path:
        raise SnapshotError("no bundle came with this installation; make one with: riposte styles")

    for module in (play_seats, play_plan):
        monkeypatch.setattr(module, "shipped_bundle", none)
    assert "no protagonist is named, and no bundle came with" in refused(capsys)
    plan, settings = planned("--protagonist", "heuristic")
    assert [name for name, _ in settings["page"]["players"]] == [
        "Heuristic", "Heuristic, not camping", "Guard",
    ]  # fmt: skip
    assert plan.has_page


def test_the_tracker_of_a_site_file_is_who_plays_unless_somebody_is_named():
    Path("s.toml").write_text('[robot_io]\ntracker = "replay"\nreplay = "bat.npy"\n')
    plan, settings = planned("s.toml")
    assert plan.antagonist.label == "replay"
    assert settings["robot_io"]["replay"] == "bat.npy"
    _, settings = planned("s.toml", "--antagonist", "mouse")
    assert settings["robot_io"]["tracker"] == "mouse"
    Path("s.toml").write_text('[robot_io]\ntracker = "policy"\n')
    assert planned("s.toml")[0].antagonist.label == "mouse"


@pytest.mark.parametrize(
    ("words", "library", "extra"),
    [
        ((), "websockets", "play"),
        (("--antagonist", "vive"), "openvr", "robot"),
        (("s.toml",), "rosbags", "robot"),
    ],
)
def test_a_missing_library_names_the_extra_that_has_it(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, words, library, extra
):
    Path("s.toml").write_text('[robot_io]\nlink = "pr2"\n')
    real = play_seats.importlib.util.find_spec
    monkeypatch.setattr(
        play_seats.importlib.util, "find_spec",
        lambda name, *rest: None if name == library else real(name, *rest),
    )  # fmt: skip
    assert refused(capsys, *words) == (
        f"riposte: play needs {library}: pip install 'riposte[{extra}]'\n"
    )


def test_opposite_a_real_robot_there_is_no_simulated_one(capsys: pytest.CaptureFixture[str]):
    Path("s.toml").write_text('[robot_io]\nlink = "pr2"\n')
    line = refused(capsys, "s.toml", "--antagonist", "scripted:stab")
    assert "is a second simulated robot, and robot_io.link is 'pr2'" in line


def test_a_folder_that_holds_a_match_or_a_run_is_refused(capsys: pytest.CaptureFixture[str]):
    Path("old").mkdir()
    Path("old/summary.json").write_text("{}")
    assert "old holds a run already" in refused(capsys, "--out", "old")


def test_a_folder_nobody_may_write_in_is_refused(capsys: pytest.CaptureFixture[str]):
    Path("file").write_text("")
    line = refused(capsys, "--out", "file/match", "--antagonist", "heuristic")
    assert "file/match" in line


def test_a_router_port_in_use_is_refused_before_anything_starts(
    capsys: pytest.CaptureFixture[str],
):
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as other:
        endpoint = f"tcp/127.0.0.1:{other.getsockname()[1]}"
        words = ("--set", f'bus.listen=["{endpoint}"]', "--antagonist", "heuristic")
        assert cli.main(["play", "--out", "m", *words]) == 2
    err = capsys.readouterr().err
    assert f"{endpoint} is in use by another program" in err
    assert err.count("\n") == 1
    assert not list(Path("m/logs").glob("*.out"))
    assert os.listdir("m")
