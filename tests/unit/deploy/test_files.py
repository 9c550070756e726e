"""Compose file, units, scripts and the Dockerfile, each by the program that knows the format."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.unit.deploy.found import DEPLOY, ROOT, compose, filled, scripts

UNITS = sorted((DEPLOY / "systemd").iterdir())
ALIVE = DEPLOY / "docker/riposte-alive"


def ran(*command: str | Path) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, timeout=100, check=False
    )


def test_the_compose_file_is_what_compose_expects():
    done = ran(
        sys.executable, "-m", "check_jsonschema", "--builtin-schema", "vendor.compose-spec",
        DEPLOY / "compose.yaml",
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr


def test_files_that_the_compose_file_mounts_are_there_or_are_made_as_it_says():
    text = (DEPLOY / "compose.yaml").read_text()
    made = set(re.findall(r"runs/compose/[\w-]+", text.split("\nname:")[0]))
    for name, service in compose()["services"].items():
        for volume in service["volumes"]:
            source = filled(volume).split(":")[0]
            if source.startswith("./runs/"):
                assert source.removeprefix("./") in made, f"{name}: {source}"
            elif source.startswith("./") and not source.startswith("./certificates/"):
                assert (ROOT / source).exists(), f"{name}: {source}"
        for network in service["networks"]:
            assert network in compose()["networks"]


def test_units_are_what_systemd_expects(tmp_path: Path):
    if shutil.which("systemd-analyze") is None:
        pytest.skip("needs systemd-analyze")
    for unit in UNITS:
        text = unit.read_text().replace("/opt/riposte/bin/riposte", "/bin/true")
        (tmp_path / unit.name).write_text(text)
    instance = tmp_path / "riposte-policy@protagonist.service"
    shutil.copy(tmp_path / "riposte-policy@.service", instance)
    names = [path for path in tmp_path.iterdir() if "@." not in path.name]
    done = ran("systemd-analyze", "verify", "--man=no", *names)
    ours = [line for line in done.stderr.splitlines() if "riposte" in line]
    assert (done.returncode, ours) == (0, []), done.stderr


def test_the_target_starts_every_unit_and_only_those():
    target = (DEPLOY / "systemd/riposte.target").read_text()
    wanted = set(" ".join(re.findall(r"(?m)^Wants=(.*)$", target)).split())
    units = {unit.name for unit in UNITS if unit.suffix == ".service"}
    assert {re.sub(r"@\w+\.", "@.", name) for name in wanted} == units


def test_only_processes_that_say_that_they_live_are_watched():
    for unit in UNITS:
        text = unit.read_text()
        is_watched = "WatchdogSec=" in text
        assert is_watched == ("Type=notify" in text), unit.name
        if "riposte router" in text:  # it has no loop of its own that could beat
            assert not is_watched
        elif unit.suffix == ".service":
            assert is_watched, unit.name


def test_the_loop_that_moves_the_robot_is_started_again_however_long_the_robot_is_off():
    """No name service, no network: robot_io ends with the code of bad input."""
    text = (DEPLOY / "systemd/riposte-robot-io.service").read_text()
    assert "RestartPreventExitStatus" not in text
    assert "StartLimitIntervalSec=0" in text


def test_only_the_loop_that_moves_the_robot_has_real_time_priority():
    real_time = [unit.name for unit in UNITS if "CPUSchedulingPolicy=fifo" in unit.read_text()]
    assert real_time == ["riposte-robot-io.service"]


def test_scripts_have_nothing_that_shellcheck_points_at():
    shellcheck = Path(sys.executable).parent / "shellcheck"
    done = ran(shellcheck, "--norc", *scripts())
    assert done.returncode == 0, done.stdout


def test_scripts_can_be_run():
    for script in scripts():
        assert os.access(script, os.X_OK) or script.suffix == ".sbatch", script


def test_alive_means_that_a_log_below_the_folder_was_touched_lately(tmp_path: Path):
    assert ran(ALIVE, tmp_path, "60").returncode == 1
    log = tmp_path / "run/logs/actor-0.jsonl"
    log.parent.mkdir(parents=True)
    log.touch()
    assert ran(ALIVE, tmp_path, "60").returncode == 0
    old = log.stat().st_mtime - 120.0
    os.utime(log, (old, old))
    done = ran(ALIVE, tmp_path, "60")
    assert done.returncode == 1
    assert "has turned its loop for 60 s" in done.stderr
    assert ran(ALIVE, tmp_path, "600").returncode == 0
    assert ran(ALIVE).returncode == 2


def test_the_dockerfile_copies_what_is_there_and_reaches_the_builder():
    text = (DEPLOY / "docker/Dockerfile").read_text()
    kept = (ROOT / ".dockerignore").read_text().splitlines()
    for line in re.findall(r"(?m)^COPY (?!--from)(.*)$", text):
        *sources, _ = [word for word in line.split() if not word.startswith("--")]
        for source in sources:
            assert (ROOT / source).exists(), source
            assert f"!{source}" in kept, source
    stages = re.findall(r"(?m)^FROM \S+ AS (\S+)$", text)
    assert {"core", "train"} <= set(stages)
    targets = {service["build"]["target"] for service in compose()["services"].values()
               if "build" in service}  # fmt: skip
    assert targets == {"core", "train"}
    assert re.search(r"(?m)^torch==", (ROOT / "constraints.txt").read_text())
    assert re.search(r"(?m)^USER 10001:10001$", text)
