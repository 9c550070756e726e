"""A short programme on disk, and a site in virtual time to play it on."""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from services.jobs.robot.player import Player
from services.jobs.virtual_site import VirtualSite
from services.robot_io.config import RobotIoConfig, SafetyConfig
from shared.identification.excitation.reading import PosePlan, Stretch, read_programme
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.twin import Twin, command_of
from studies.closing_the_loop.recording import PARKED

COLUMNS = ("x", "y", "z", "qw", "qx", "qy", "qz")


def home_pose() -> np.ndarray:
    """Return float64[7], where the robot waits between bouts."""
    model = FencingModel.build(SimConfig())
    return Twin(model, command_of(1.0, 0.0), 15.0, person=True).tools()[1]


def sway(home: np.ndarray, size: float, seconds: float = 2.0) -> np.ndarray:
    """Return float64[C, 7]: to one side and back, so far (m)."""
    at = 0.01 * np.arange(round(seconds / 0.01))
    poses = np.tile(home, (len(at), 1))
    poses[:, 1] += 0.5 * size * (1.0 - np.cos(2.0 * np.pi * at / seconds))
    return poses


def write_folder(folder: Path, motions: dict[str, np.ndarray], **model: Any) -> Path:
    """Write what `identify excite` does, without its predictions; the last motion is held out."""
    entries: list[dict[str, Any]] = []
    told: list[dict[str, Any]] = []
    for name, poses in motions.items():
        (folder / name).mkdir(parents=True)
        path = folder / name / "command.parquet"
        t_ns = 10_000_000 * np.arange(len(poses))
        table = {"t_ns": t_ns, **{key: poses[:, k] for k, key in enumerate(COLUMNS)}}
        pq.write_table(pa.table(table), path)
        entries.append({"name": name, "split": "test" if name == list(motions)[-1] else "train"})
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        told.append({"name": name, "sha256": digest, "lead_m": 0.03, "lead_rad": 0.1})
    manifest = {
        "schema": 1, "control": "pose", "model": {"kind": "pr2", **model}, "trajectory": entries,
    }  # fmt: skip
    (folder / "dataset.toml").write_text(tomli_w.dumps(manifest))
    (folder / "programme.toml").write_text(tomli_w.dumps({"schema": 1, "recording": told}))
    return folder


class Stage:
    """A player on a site, and the person beside it."""

    def __init__(self, folder: Path, plan: PosePlan, **robot: Any) -> None:
        parked = {"tracker": "replay", "replay": str(PARKED)}
        cfg = RobotIoConfig(twin_filter=1.0, twin_delay=0.0, **{**parked, **robot})
        self.folder = folder
        self.site = VirtualSite(folder, cfg, SafetyConfig(ramp=0.5), SimConfig())
        self.bus = self.site.join("robot-1")
        self.said: list[str] = []
        stretches: list[Stretch] = list(plan.stretches)
        self.player = Player(
            plan, stretches, 1.0, "test", 2.0, self.bus, self.site.clock, self.said.append
        )

    def until(self, *steps: str, seconds: float = 40.0) -> None:
        for _ in range(round(seconds / 0.01)):
            if self.player.step in steps or self.player.is_over:
                return
            self.site.tick(self.player)
        raise AssertionError(f"{self.player.step} after {seconds} s: {self.said}")

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.01)):
            self.site.tick(self.player)

    def arm(self) -> None:
        self.until("waiting")
        self.run(0.1)
        reply = self.site.ask(self.bus, "arm")
        assert reply.accepted, reply.reasons

    def close(self) -> None:
        self.player.close()
        self.site.close()


def plan_in(folder: Path, *names: str) -> PosePlan:
    """Return a written programme of sways of these names."""
    home = home_pose()
    motions = {name: sway(home, 0.03 + 0.02 * k) for k, name in enumerate(names)}
    return read_programme(write_folder(folder, motions))
