"""Writes a data set: the folder appears whole or not at all, and reads back as it was."""

# pyright: basic
# (pyarrow's types are partial)

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from shared.identification.dataset.checks import is_too_large
from shared.identification.dataset.folders import model_table, whole_folder
from shared.identification.dataset.manifest import FILE, SCHEMA
from shared.identification.dataset.reading import NANO, read_dataset
from shared.identification.dataset.tables import TIME
from shared.identification.dataset.types import POSE, Dataset, Float64, Trajectory
from shared.runtime.files import sync_folder

UNITS: Final = {
    "q": "rad (m of a slide)", "qd": "rad/s (m/s of a slide)", "effort": "N m (N of a slide)",
    "pose": "rad (m of a slide)", "position": "rad (m of a slide)", "torque": "N m (N of a slide)",
}  # fmt: skip


def write_dataset(
    dataset: Dataset,
    folder: Path,
    generator: Mapping[str, Any],
    files: Mapping[str, bytes] | None = None,
) -> None:
    """Write a data set, Parquet and ``dataset.toml``; ``read_dataset`` gives the same back.

    Args:
        dataset: its folder, caveats and hash are left out. Times are kept to the ns; those of
            every trajectory begin at 0 with the first command or the first joint reading. A model
            file is named by its way from the new folder.
        folder: the new folder; must not exist, or be empty.
        generator: who wrote it and how, for people; TOML values.
        files: more files for the folder by name, the model's own for one.

    Raises:
        IdentificationError: the folder is not empty or cannot be written, or what is written
            could not be read again.
        ValueError: a trajectory does not begin at 0.
    """
    for each in dataset.trajectories:
        if min(each.command_at[0], each.joints_at[0]) != 0.0:
            raise ValueError(f"trajectory {each.name!r} does not begin at 0")
    folder = folder.absolute()
    with whole_folder(folder) as temporary:
        for name, data in (files or {}).items():
            _write(temporary / name, data)
        for each in dataset.trajectories:
            (temporary / each.name).mkdir()
            for name, table in _tables(dataset, each).items():
                _write(temporary / each.name / f"{name}.parquet", _parquet(table))
            sync_folder(temporary / each.name)
        manifest = tomli_w.dumps(_manifest(dataset, folder, generator))
        _write(temporary / FILE, manifest.encode())
        sync_folder(temporary)
        read_dataset(temporary)


def _manifest(dataset: Dataset, folder: Path, generator: Mapping[str, Any]) -> dict[str, Any]:
    wide = [
        joint for index, joint in enumerate(dataset.joints)
        if any(is_too_large(each.q[:, index]) for each in dataset.trajectories)
    ]  # fmt: skip
    return {
        "schema": SCHEMA,
        "control": dataset.control,
        **({"continuous": wide} if wide else {}),
        "model": model_table(dataset.source, folder),
        "generator": dict(generator),
        "trajectory": [_entry(each, dataset.joints) for each in dataset.trajectories],
    }


def _entry(trajectory: Trajectory, joints: tuple[str, ...]) -> dict[str, Any]:
    entry: dict[str, Any] = {"name": trajectory.name, "split": trajectory.split}
    if trajectory.repeats:
        entry["repeats"] = trajectory.repeats
    for key, values in (
        ("initial", trajectory.initial_q), ("initial_velocity", trajectory.initial_qd),
    ):  # fmt: skip
        entry[key] = dict(zip(joints, values.tolist(), strict=True))
    return entry


def _tables(dataset: Dataset, each: Trajectory) -> dict[str, Any]:
    made = {
        "command": _table(each.command_at, {
            dataset.control: (dataset.actuators, each.command),
        }),
        "joints": _table(each.joints_at, {
            kind: (tuple(f"{kind}_{joint}" for joint in dataset.joints), values)
            for kind, values in (("q", each.q), ("qd", each.qd), ("effort", each.effort))
            if values is not None
        }),
    }  # fmt: skip
    if each.tracker_at is not None and each.tracker is not None:
        made["tracker"] = _table(each.tracker_at, {"pose": (POSE, each.tracker)})
    return made


def _table(times: Float64, blocks: dict[str, tuple[tuple[str, ...], Float64]]) -> Any:
    fields = [pa.field(TIME, pa.int64(), nullable=False, metadata={"unit": "ns"})]
    arrays = [pa.array(np.round(times * NANO).astype(np.int64))]
    for kind, (names, values) in blocks.items():
        for name, column in zip(names, values.T, strict=True):
            unit = UNITS[kind]
            if kind == "pose":
                unit = "m" if name in POSE[:3] else "1"
            fields.append(pa.field(name, pa.float64(), nullable=False, metadata={"unit": unit}))
            arrays.append(pa.array(np.ascontiguousarray(column)))
    return pa.Table.from_arrays(arrays, schema=pa.schema(fields))


def _parquet(table: Any) -> bytes:
    sink = pa.BufferOutputStream()
    encodings = dict.fromkeys(table.column_names, "BYTE_STREAM_SPLIT")
    encodings[TIME] = "DELTA_BINARY_PACKED"
    pq.write_table(
        table, sink, compression="zstd", use_dictionary=False, column_encoding=encodings,
        write_page_checksum=True,
    )  # fmt: skip
    return sink.getvalue().to_pybytes()


def _write(path: Path, data: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("xb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
