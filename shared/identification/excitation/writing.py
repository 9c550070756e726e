"""Writes a programme: a data set that lacks only what the robot will log."""

# pyright: basic
# (pyarrow's types are partial)

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import tomli_w

from shared.identification.dataset.folders import model_table, whole_folder
from shared.identification.dataset.manifest import FILE, SCHEMA
from shared.identification.dataset.reading import NANO
from shared.identification.dataset.tables import TIME
from shared.identification.dataset.types import Trajectory
from shared.identification.excitation.prediction import Prediction
from shared.identification.excitation.programme import SHOWS, Programme
from shared.runtime.files import atomic_write

PROGRAMME_FILE: Final = "programme.toml"
PICTURE_FILE: Final = "programme.png"
PROGRAMME_SCHEMA: Final = 1
"""Of ``programme.toml``; goes up when what is played changes its meaning."""
COMMAND_FILE: Final = "command.parquet"


def write_programme(
    programme: Programme,
    prediction: Prediction,
    folder: Path,
    generator: Mapping[str, Any],
    picture: bytes,
) -> None:
    """Write a programme: ``NAME/command.parquet`` each, the manifests and the picture.

    With ``joints.parquet``, and ``tracker.parquet`` where there is a tracker, put beside each
    ``command.parquet``, the folder is a data set.

    Args:
        programme: the motions.
        prediction: what they will show.
        folder: the new folder; must not exist, or be empty.
        generator: who wrote it and how, for people; TOML values.
        picture: PNG of it all.

    Raises:
        IdentificationError: the folder is not empty, or cannot be written.
    """
    folder = folder.absolute()
    with whole_folder(folder) as temporary:
        digests: dict[str, str] = {}
        for each in programme.predicted.trajectories:
            (temporary / each.name).mkdir()
            table = _table(each, programme.predicted.actuators)
            digests[each.name] = hashlib.sha256(table).hexdigest()
            atomic_write(temporary / each.name / COMMAND_FILE, table)
        atomic_write(temporary / PICTURE_FILE, picture)
        made = tomli_w.dumps(_programme(programme, prediction, generator, digests))
        atomic_write(temporary / PROGRAMME_FILE, made.encode())
        manifest = tomli_w.dumps(_manifest(programme, folder, generator))
        atomic_write(temporary / FILE, manifest.encode())


def _table(each: Trajectory, columns: tuple[str, ...]) -> bytes:
    arrays = {TIME: pa.array(np.round(each.command_at * NANO).astype(np.int64))}
    for name, values in zip(columns, each.command.T, strict=True):
        arrays[name] = pa.array(np.ascontiguousarray(values))
    sink = pa.BufferOutputStream()
    pq.write_table(pa.table(arrays), sink, compression="zstd", write_page_checksum=True)
    return sink.getvalue().to_pybytes()


def _manifest(programme: Programme, folder: Path, generator: Mapping[str, Any]) -> dict[str, Any]:
    dataset = programme.predicted
    entries: list[dict[str, Any]] = []
    for each in dataset.trajectories:
        entry: dict[str, Any] = {"name": each.name, "split": each.split}
        if each.repeats:
            entry["repeats"] = each.repeats
        entries.append(entry)
    return {
        "schema": SCHEMA,
        "control": dataset.control,
        "model": model_table(dataset.source, folder),
        "generator": dict(generator),
        "trajectory": entries,
    }


def _programme(
    programme: Programme,
    prediction: Prediction,
    generator: Mapping[str, Any],
    digests: Mapping[str, str],
) -> dict[str, Any]:
    joints = programme.predicted.joints
    return {
        "schema": PROGRAMME_SCHEMA,
        "generator": dict(generator),
        "seconds": round(programme.seconds, 3),
        "home": dict(zip(joints, programme.arm.home.tolist(), strict=True)),
        "share_visible": round(prediction.share, 4),
        "recording": [
            {
                "name": part.plan.name,
                "split": part.plan.split,
                "repeats": part.plan.repeats,
                "shows": SHOWS[part.plan.kind],
                "seconds": round(float(part.at[-1]), 3),
                "sha256": digests[part.plan.name],
                "lead_m": round(float(lead[0]), 4),
                "lead_rad": round(float(lead[1]), 4),
                "effort_share": {
                    name: round(float(share), 3) for name, share in zip(joints, effort, strict=True)
                },
            }
            for part, effort, lead in zip(
                programme.parts, programme.effort, programme.lead, strict=True
            )
        ],
        "effect": [
            {
                "name": outlook.effect,
                "visible": outlook.is_visible,
                "places": [
                    {
                        "place": power.place,
                        "size": power.size,
                        "unit": power.unit,
                        "signal_to_noise": round(power.ratio, 3),
                        "named_from": float(f"{power.named_from:.3g}"),
                    }
                    for power in outlook.powers
                ],
            }
            for outlook in prediction.outlooks
        ],
        "alike": [
            {
                "first": pair.first.label,
                "second": pair.second.label,
                "cosine": round(pair.cosine, 4),
            }
            for pair in prediction.pairs
        ],
    }
