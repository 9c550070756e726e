"""From thirty held poses of a twin to a bat that is tracked where it is, through the real wheel."""

import datetime
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from services.jobs.robot.calibrate import Gathering, calibration_of
from services.robot_io.vive.calibration import save_calibration
from services.robot_io.vive.config import ViveConfig
from shared.testing.fake_vive.runtime import FakeVive
from tests.integration.calibration.bench import Bench, matrix_of
from tests.integration.vive.conftest import SERIAL
from tests.unit.calibration.making import truth

GRIP = 0.12
OUTLIERS = (4, 11, 23)
"""Poses in which a reflection shifts the tracker by centimetres."""


def test_thirty_poses_of_a_hand_moved_twin_make_a_bat_that_is_where_it_is(
    vive: FakeVive, tmp_path: Path
):
    rng = np.random.default_rng(7)
    known = truth(rng)
    base, mount = np.eye(4), np.eye(4)  # torso_from_base, tracker_from_tool
    base[:3, :3], base[:3, 3] = known.torso_from_base[0].as_matrix(), known.torso_from_base[1]
    mount[:3, :3], mount[:3, 3] = known.tracker_from_tool[0].as_matrix(), known.tracker_from_tool[1]
    cfg = ViveConfig(
        serial=SERIAL, calibration=str(tmp_path / "vive.toml"), mount_position=(0.0, 0.0, GRIP)
    )
    bench = Bench(vive, cfg, rng, began=1000.0)
    said: list[str] = []
    gathering = Gathering(bench.desk, bench.clock, said.append, 30)

    def seen(noise: np.ndarray) -> np.ndarray:
        return np.linalg.inv(base) @ matrix_of(bench.tool) @ np.linalg.inv(mount) @ noise

    while not gathering.tick():
        taken = len(gathering.collector.pairs)
        assert bench.clock.now() < 1200.0, said[-1:]
        target, noise = bench.another_pose(), bench.noise(0.001, 0.1)
        if taken in OUTLIERS:
            noise[:3, 3] += (0.05, -0.03, 0.04)
        bench.travel(target)
        for tick in range(150):
            bench.tick(seen(noise))
            if tick % 5 == 0 and (gathering.tick() or len(gathering.collector.pairs) > taken):
                break
    assert not bench.states.is_valid[0]
    refused = bench.ask("arm")
    assert any("no calibration" in why and "run riposte robot calibrate" in why
               for why in refused.reasons)  # fmt: skip
    now = datetime.datetime.fromtimestamp(bench.clock.wall_ns() * 1e-9, datetime.UTC)
    made = calibration_of(*gathering.collector.arrays(), gathering.serial, now)
    assert (made.serial, made.poses, made.rejected) == (SERIAL, 27, 3)
    found = np.array([*made.torso_from_base.position, *made.torso_from_base.orientation])
    assert known.error_within_a_metre(found, rng) < 0.006
    assert made.expected_mm < 8.0
    save_calibration(Path(cfg.calibration), made)
    bench.close()

    # Restarted, with the tracker on a person's bat.
    bench = Bench(vive, cfg, rng, began=5000.0)
    bat = np.eye(4)
    bat[:3, :3] = Rotation.from_rotvec([0.2, 0.4, 3.0]).as_matrix()
    bat[:3, 3] = (0.4, 0.1, 1.1)
    tracker_from_bat = np.eye(4)
    tracker_from_bat[2, 3] = GRIP
    torso = np.linalg.inv(base) @ np.linalg.inv(bench.world_from_torso)
    for _ in range(40):
        bench.tick(torso @ bat @ np.linalg.inv(tracker_from_bat) @ bench.noise(0.0003, 0.02))
    assert bench.states.is_valid[0]
    off = np.linalg.norm(bench.states.bats[0, :3] - bat[:3, 3])
    assert off < 0.008
    assert any("calibrated 0.0 days ago on 27 poses" in what for what in bench.ask("check").passed)
    bench.close()
