"""`riposte robot calibrate` at a running robot_io, each a process, in real time."""

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from services.robot_io.vive.calibration import load_calibration
from shared.bus.ports import free_port
from shared.testing.fake_vive.runtime import has_compiler
from tests.integration.calibration.hand_moved import SEED
from tests.integration.robot_io.site import ROOT
from tests.integration.vive.conftest import SERIAL
from tests.unit.calibration.making import truth

pytestmark = [pytest.mark.zenoh, pytest.mark.slow]


@pytest.fixture
def endpoint(tmp_path: Path) -> Iterator[str]:
    if not has_compiler():
        pytest.skip("gcc is not installed: the double of SteamVR cannot be built")
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    words = ("-m", "services.router", "--run", str(tmp_path), "--listen", endpoint)
    router = subprocess.Popen([sys.executable, *words], cwd=ROOT)
    yield endpoint
    router.kill()
    router.wait()


@pytest.mark.timeout(300)
def test_the_command_leaves_a_calibration_and_then_a_dock(endpoint: str, tmp_path: Path):
    site, out = tmp_path / "site.toml", tmp_path / "vive.toml"
    site.write_text(f'[vive]\nserial = "{SERIAL}"\ncalibration = {json.dumps(str(out))}\n')
    script = ROOT / "tests" / "integration" / "calibration" / "hand_moved.py"
    robot_io = subprocess.Popen(
        [sys.executable, str(script), endpoint, str(site), str(tmp_path)],
        cwd=ROOT, env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"},
    )  # fmt: skip

    def calibrate(*words: str) -> "subprocess.CompletedProcess[str]":
        command = [sys.executable, "-m", "services.cli", "robot", "calibrate", str(site)]
        where = ("--connect", endpoint, "--run-id", "live", "--json")
        return subprocess.run(
            [*command, *where, *words], cwd=ROOT, capture_output=True, text=True, timeout=240
        )

    try:
        done = calibrate()
        assert done.returncode == 0, done.stderr
        assert "pose 30 of 30" in done.stderr
        said = json.loads(done.stdout)
        assert said["file"] == str(out)
        made = load_calibration(out)
        assert made.poses == 30
        assert made.held_out_mm < 3.0
        rng = np.random.default_rng(SEED)
        known = truth(rng)
        base = made.torso_from_base
        found = np.array([*base.position, *base.orientation])
        assert known.error_within_a_metre(found, rng) < 0.003
        done = calibrate("--dock")
        assert done.returncode == 0, done.stderr
        assert load_calibration(out).dock is not None
        assert load_calibration(out).made_at == made.made_at
    finally:
        robot_io.kill()
        robot_io.wait()
    done = calibrate()
    assert done.returncode == 2
    assert "robot_io says nothing of a tracker for 10 s" in done.stderr.splitlines()[-1]
