"""A programme from its folder to a data set, between processes on a real bus."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from shared.identification.dataset.reading import read_dataset
from tests.integration.robot_io.site import ROOT, Site
from tests.unit.jobs.programme_stage import home_pose, plan_in, sway, write_folder

pytestmark = [pytest.mark.zenoh, pytest.mark.slow, pytest.mark.timeout(300)]
PARKED = ROOT / "deploy" / "parked_bat.npy"


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    site = Site(
        tmp_path / "run", 'robot_io.tracker="replay"', f'robot_io.replay="{PARKED}"',
        "safety.state_trip=0.5", "safety.command_trip=2.0",
    )  # fmt: skip
    yield site
    site.close()


def player(site: Site, programme: Path, run: Path) -> "subprocess.Popen[str]":
    words = [
        "robot", "play-programme", str(programme), "--run", str(run), "--run-id", "live",
        "--connect", site.endpoint, "--countdown", "1",
    ]  # fmt: skip
    process = subprocess.Popen(
        [sys.executable, "-m", "services.cli", *words], cwd=ROOT, text=True, stderr=subprocess.PIPE
    )
    site.processes.append(process)  # type: ignore[arg-type]
    return process


def test_a_programme_is_played_recorded_and_read_as_a_data_set(site: Site, tmp_path: Path):
    plan = plan_in(tmp_path / "programme", "one", "two")
    for role in ("referee", "recorder"):
        site.service(role, "--set", "recorder.live=false")
    process = player(site, plan.folder, tmp_path / "run")
    site.arm()
    site.until(lambda: process.poll() is not None, 120.0)
    _, said = process.communicate(timeout=10)
    assert process.returncode == 0, said
    assert "2 of 2: two" in said
    assert site.is_mode("disarmed")
    bouts = tmp_path / "run" / "bouts"
    site.until(lambda: len(list(bouts.glob("*/gate.parquet"))) == 2)
    site.until(lambda: all('"finished"' in each.read_text() for each in bouts.glob("*/bout.json")))
    words = [
        "identify", "from-bouts", str(tmp_path / "run"), str(tmp_path / "arm"),
        "--programme", str(plan.folder),
    ]  # fmt: skip
    made = subprocess.run(
        [sys.executable, "-m", "services.cli", *words], cwd=ROOT, text=True, capture_output=True,
        timeout=100, check=False,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    dataset = read_dataset(tmp_path / "arm")
    assert [(each.name, each.split) for each in dataset.trajectories] == [
        ("one", "train"), ("two", "test"),
    ]  # fmt: skip
    for each, stretch in zip(dataset.trajectories, plan.stretches, strict=True):
        assert np.ptp(each.command[:, 1]) == pytest.approx(np.ptp(stretch.poses[:, 1]), abs=5e-3)
        assert np.ptp(each.q, axis=0).max() > 0.01


def test_ctrl_c_shuts_the_gate_and_says_how_to_go_on(site: Site, tmp_path: Path):
    home = home_pose()
    motions = {"one": sway(home, 0.03, 20.0), "two": sway(home, 0.03, 20.0)}
    folder = write_folder(tmp_path / "programme", motions)
    for role in ("referee", "recorder"):
        site.service(role, "--set", "recorder.live=false")
    process = player(site, folder, tmp_path / "run")
    site.arm()
    site.until(lambda: bool(site.states) and site.states[-1].seconds > 0.5, 60.0)
    process.send_signal(2)
    site.until(lambda: process.poll() is not None, 30.0)
    _, said = process.communicate(timeout=10)
    assert process.returncode == 130, said
    assert "to go on: --only one two" in said
    site.until(lambda: site.is_mode("disarmed"))
