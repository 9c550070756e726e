"""robot_io in a process of its own, its twin's gripper moved by a hand from pose to pose.

``hand_moved.py ENDPOINT SITE STEAMVR``: the double of SteamVR is installed in the folder STEAMVR;
its tracker is taped to the gripper.
"""

import sys
import threading
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from services.robot_io.__main__ import build, run
from services.robot_io.service import RobotIo
from shared.bus.base import Bus
from shared.clock import SystemClock
from shared.runtime.serve import ServeArgs, open_site_bus
from shared.testing.fake_vive.runtime import FakeVive, compile_client
from tests.integration.calibration.bench import SLOT, matrix_of
from tests.integration.vive.conftest import SERIAL
from tests.unit.calibration.making import truth

SEED = 11
PERIOD = 0.01
HELD = 2.2


def move(service: RobotIo, vive: FakeVive, stop: threading.Event) -> None:
    """Take the gripper to another pose every few seconds; the tracker is where it is."""
    parts = service._parts
    rng = np.random.default_rng(SEED)
    known = truth(rng)
    base, mount = np.eye(4), np.eye(4)
    base[:3, :3], base[:3, 3] = known.torso_from_base[0].as_matrix(), known.torso_from_base[1]
    mount[:3, :3], mount[:3, 3] = known.tracker_from_tool[0].as_matrix(), known.tracker_from_tool[1]
    home = Rotation.from_quat(parts.home.orientation, scalar_first=True)
    left = 0.0
    while not stop.wait(PERIOD):
        left -= PERIOD
        if left <= 0.0:
            left = HELD
            turn = Rotation.from_rotvec(np.deg2rad(rng.uniform(-35.0, 35.0, 3))) * home
            place = np.array(parts.home.position) + rng.uniform(-0.12, 0.12, 3)
            parts.link.write(np.concatenate([place, turn.as_quat(scalar_first=True)]))
        tool = matrix_of(service._robot.tool)
        vive.put(SLOT, SERIAL, np.linalg.inv(base) @ tool @ np.linalg.inv(mount))


def main(endpoint: str, site: str, steamvr: str) -> None:
    """Run until killed."""
    import os

    folder = Path(steamvr)
    vive = FakeVive(folder / "steamvr", compile_client(folder / "built"))
    vive.put(SLOT, SERIAL)
    os.environ.update(vive.environment)
    args = ServeArgs(
        role="robot-io", site=Path(site), name="robot-io-0", run=folder, run_id="live",
        connect=(endpoint,), overrides=("robot_io.tracker=vive", "robot_io.twin_filter=1.0",
        "robot_io.twin_force=60.0"),
    )  # fmt: skip
    clock = SystemClock()
    bus: Bus = open_site_bus(args, clock)
    service = build(args, bus, clock)
    stop = threading.Event()
    threading.Thread(target=move, args=(service, vive, stop), daemon=True).start()
    run(service, bus, clock, args, stop)


if __name__ == "__main__":
    main(*sys.argv[1:])
