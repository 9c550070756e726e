"""Small data sets on disk, written with pyarrow alone."""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq

JOINTS = ("shoulder", "elbow")
MANIFEST = """schema = 1
control = "position"
[model]
kind = "mjcf"
path = "arm.xml"
[[trajectory]]
name = "one"
split = "train"
[[trajectory]]
name = "two"
split = "train"
[[trajectory]]
name = "three"
split = "test"
"""


def table(path: Path, columns: dict) -> None:
    made = pa.table({name: pa.array(values) for name, values in columns.items()})
    path.parent.mkdir(parents=True, exist_ok=True)
    if path.suffix == ".csv":
        pyarrow.csv.write_csv(made, path)
    else:
        pq.write_table(made, path)


def motion(seed: int, seconds: float = 4.0, period_ns: int = 10_000_000) -> dict:
    """Return ``joints`` of a sum of sines, with velocities and efforts."""
    t_ns = 1_700_000_000_000_000_000 + np.arange(int(seconds * 1e9) // period_ns) * period_ns
    times = (t_ns - t_ns[0]) / 1e9
    columns: dict = {"t_ns": t_ns}
    for index, joint in enumerate(JOINTS):
        speed = 2.0 + 0.37 * seed + 0.5 * index
        columns[f"q_{joint}"] = 0.4 * (1.0 - np.cos(speed * times))
        columns[f"qd_{joint}"] = 0.4 * speed * np.sin(speed * times)
        columns[f"effort_{joint}"] = np.cos(speed * times)
    return columns


def command(joints: dict) -> dict:
    return {"t_ns": joints["t_ns"], **{name: joints[f"q_{name}"] for name in JOINTS}}


def poses(joints: dict, offset_ns: int = 0) -> dict:
    """Return ``tracker``: a point on a line, turned about x."""
    angle = joints["q_elbow"]
    zero = np.zeros(len(angle))
    return {
        "t_ns": joints["t_ns"] + offset_ns,
        "x": angle, "y": zero, "z": zero + 0.5,
        "qw": np.cos(0.5 * angle), "qx": np.sin(0.5 * angle), "qy": zero, "qz": zero,
    }  # fmt: skip


def written(folder: Path, suffix: str = ".parquet", manifest: str = MANIFEST) -> Path:
    """Write a sound data set of three trajectories; return its folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "dataset.toml").write_text(manifest)
    (folder / "arm.xml").write_text("<mujoco/>")
    for seed, name in enumerate(("one", "two", "three")):
        joints = motion(seed)
        table(folder / name / f"joints{suffix}", joints)
        table(folder / name / f"command{suffix}", command(joints))
        table(folder / name / f"tracker{suffix}", poses(joints))
    return folder
