"""A person with a tracked bat, at a SteamVR that is none; for whoever needs an opponent."""

import datetime
import threading
import time
from pathlib import Path

import numpy as np

from services.robot_io.scene import torso_of
from services.robot_io.vive.calibration import Calibration, Frame, save_calibration
from services.robot_io.vive.frames import inverse
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.testing.fake_vive.runtime import FakeVive

SLOT = 2
PERIOD = 0.004


class Person:
    """Moves a bat at 250 Hz; base stations in the world's frame, the tracker in the bat's."""

    def __init__(self, folder: Path, library: Path, serial: str) -> None:
        """Install the SteamVR, and write the calibration that belongs to it.

        Args:
            folder: gets both.
            library: from ``compile_client``.
            serial: of the tracker.
        """
        self.vive = FakeVive(folder / "steamvr", library)
        self.environment = self.vive.environment
        self.calibration = folder / "vive.toml"
        self.serial = serial
        self.is_lost = False
        torso_from_world = inverse(torso_of(FencingModel.build(SimConfig())))
        exact = Frame(position=(0.0, 0.0, 0.0), orientation=(1.0, 0.0, 0.0, 0.0))
        save_calibration(
            self.calibration,
            Calibration(
                made_at=datetime.datetime.now(datetime.UTC), serial=serial,
                torso_from_base=Frame(
                    position=torso_from_world.position, orientation=torso_from_world.orientation
                ),
                tracker_from_tool=exact, poses=30, rejected=0, residual_mm=0.0, held_out_mm=0.0,
                expected_mm=0.0, spread_deg=20.0,
            ),
        )  # fmt: skip
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._move, daemon=True)
        self._put(0.0)
        self._thread.start()

    @property
    def settings(self) -> tuple[str, ...]:
        """Return the overrides of a site file."""
        return (
            "robot_io.tracker=vive", f"vive.serial={self.serial}",
            f"vive.calibration={self.calibration}",
        )  # fmt: skip

    def bat(self, seconds: float) -> np.ndarray:
        """Return float64[4, 4], the bat in the world: thrusts at the target, 0.5 times a second."""
        matrix = np.diag([-1.0, -1.0, 1.0, 1.0])  # the blade along -x, as an antagonist's
        matrix[:3, 3] = (0.9 - 0.15 * np.sin(np.pi * seconds), 0.0, 1.05)
        return matrix

    def close(self) -> None:
        """Stand still."""
        self._stop.set()
        self._thread.join()
        self.vive.close()

    def _move(self) -> None:
        began = time.monotonic()
        while not self._stop.wait(PERIOD):
            self._put(time.monotonic() - began)

    def _put(self, seconds: float) -> None:
        result = 201 if self.is_lost else 200
        self.vive.put(SLOT, self.serial, self.bat(seconds), result=result, battery=0.77)
