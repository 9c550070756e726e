"""Keeps the base fit on disk, so that an identification that was stopped goes on from there."""

from pathlib import Path

import msgspec

from shared.identification.dataset.types import Dataset
from shared.identification.fitting.base import SavedFits
from shared.identification.search.searched import Search
from shared.runtime.files import atomic_write

FILE = "base_fit.json"
SCHEMA = 3


class _Saved(msgspec.Struct, frozen=True, kw_only=True):
    schema: int = SCHEMA
    dataset: str
    """SHA-256."""
    model: str
    seed: int
    parameters: list[str]
    parts: list[float]
    whole: list[float]
    starts_agree: bool
    is_torque: bool


def save(folder: Path, dataset: Dataset, seed: int, found: Search) -> None:
    """Write the base fit of a search, in a folder that need not be there."""
    folder.mkdir(parents=True, exist_ok=True)
    fits = fits_of(found)
    kept = _Saved(
        dataset=dataset.hash,
        model=repr(dataset.source),
        seed=seed,
        parameters=list(fits.names),
        parts=list(fits.parts),
        whole=list(fits.whole),
        starts_agree=fits.starts_agree,
        is_torque=fits.is_torque,
    )
    atomic_write(folder / FILE, msgspec.json.encode(kept))


def fits_of(found: Search) -> SavedFits:
    """Return the base fit of a search, for another one to begin with."""
    return SavedFits(
        tuple(each.name for each in found.problem.parameters),
        tuple(found.base_parts.z.tolist()),
        tuple(found.base.z.tolist()),
        found.base.starts_agree,
        found.problem.noise.is_torque,
    )


def load(folder: Path, dataset: Dataset, seed: int) -> SavedFits | None:
    """Return the base fit of the same data, model and seed; None if there is none."""
    try:
        kept = msgspec.json.decode((folder / FILE).read_bytes(), type=_Saved)
    except (OSError, ValueError, RecursionError):
        return None
    same = (kept.schema, kept.dataset, kept.model, kept.seed)
    if same != (SCHEMA, dataset.hash, repr(dataset.source), seed):
        return None
    if not len(kept.parts) == len(kept.whole) == len(kept.parameters):
        return None
    return SavedFits(
        tuple(kept.parameters),
        tuple(kept.parts),
        tuple(kept.whole),
        kept.starts_agree,
        kept.is_torque,
    )
