"""Calibrations and pairs of poses with a known answer."""

import datetime
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np
from scipy.spatial.transform import Rotation

from services.robot_io.vive.calibration import Calibration, Frame, save_calibration

STAND = Frame(position=(0.0, 0.0, 0.0), orientation=(1.0, 0.0, 0.0, 0.0))


def calibration(**changed: Any) -> Calibration:
    made = Calibration(
        made_at=datetime.datetime.now(datetime.UTC), serial="LHR-00000001",
        torso_from_base=STAND, tracker_from_tool=STAND, poses=30, rejected=1, residual_mm=3.0,
        held_out_mm=4.0, expected_mm=3.5, spread_deg=20.0,
    )  # fmt: skip
    return msgspec.structs.replace(made, **changed)


def write(path: Path, made: Calibration) -> Path:
    save_calibration(path, made)
    return path


class Truth(NamedTuple):
    """What a calibration should find."""

    torso_from_base: tuple[Rotation, np.ndarray]
    tracker_from_tool: tuple[Rotation, np.ndarray]

    def error_within_a_metre(self, found: np.ndarray, rng: np.random.Generator) -> float:
        """Return the mean error of places within a metre of the torso frame (m)."""
        turn, place = self.torso_from_base
        places = rng.uniform(-1.0, 1.0, (500, 3))
        seen = turn.inv().apply(places - place)
        there = Rotation.from_quat(found[3:], scalar_first=True).apply(seen) + found[:3]
        return float(np.linalg.norm(there - places, axis=1).mean())


def truth(rng: np.random.Generator) -> Truth:
    return Truth(
        (Rotation.random(rng=rng), rng.uniform(-2.0, 2.0, 3)),
        (Rotation.random(rng=rng), np.array([0.05, 0.09, 0.04])),
    )


def pairs(
    known: Truth, rng: np.random.Generator, count: int = 30, degrees: float = 35.0,
    outliers: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return float64[N, 7] of tracker and tool, with the noise of real ones.

    1 mm and 0.1 degrees an axis for the tracker, 2 mm and 0.2 degrees for the robot.
    """
    (base, base_at), (mount, mount_at) = known
    tool = Rotation.from_rotvec(np.deg2rad(rng.uniform(-degrees, degrees, (count, 3))))
    tool_at = np.array([0.6, -0.2, 0.1]) + rng.uniform(-0.25, 0.25, (count, 3))
    tracker = base.inv() * tool * mount.inv()
    tracker_at = base.inv().apply(tool_at - base_at) - tracker.apply(mount_at)
    seen = _noisy(tracker, tracker_at, 0.001, 0.1, rng)
    seen[: int(outliers * count), :3] += rng.normal(0.0, 0.08, (int(outliers * count), 3))
    return seen, _noisy(tool, tool_at, 0.002, 0.2, rng)


def _noisy(
    turn: Rotation, place: np.ndarray, metres: float, degrees: float, rng: np.random.Generator
) -> np.ndarray:
    off = Rotation.from_rotvec(np.deg2rad(rng.normal(0.0, degrees, place.shape)))
    return np.hstack(
        [place + rng.normal(0.0, metres, place.shape), (off * turn).as_quat(scalar_first=True)]
    )
