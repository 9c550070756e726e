"""The bouts of a tournament as one table, in memory and as a Parquet file.

One row a bout, with the points by the rule that gave them and both sides' eight features, one
column per feature and side (``antagonist_mean_velocity``, ...). Where the table comes from is in
the file's metadata, so that it means something without the folder it lay in.
"""

# pyright: basic
# (pyarrow's types are partial)

import dataclasses
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from numpy.typing import NDArray

from shared.errors import RiposteError
from shared.game.rules import RuleBook
from shared.messages.training import AGENTS
from shared.runtime.files import atomic_write
from shared.styles.features import FEATURES
from shared.telemetry.archive import table_of

SCHEMA = 1
"""Of the file; goes up when a column changes its meaning."""
METADATA_KEY = b"riposte"
COUNTS = ("bout", "attack_steps", "penalty_steps", "camping_steps")
FEATURE_COLUMNS = tuple(f"{agent}_{feature.name}" for agent in AGENTS for feature in FEATURES)


class Provenance(msgspec.Struct, frozen=True, kw_only=True):
    """Where the bouts come from."""

    run: str
    """Name of the run whose players met."""
    seed: int
    """Of the tournament."""
    model: str
    """Hash of the simulator model."""
    control_timestep: float
    """(s)."""
    game: RuleBook
    labels: dict[str, str] = {}
    """Short names of the players, by reference."""
    commit: str = ""
    """Of the code that played them."""


class _Header(msgspec.Struct, frozen=True, kw_only=True):
    """What the file's metadata says."""

    schema: int
    antagonists: tuple[str, ...]
    protagonists: tuple[str, ...]
    provenance: Provenance


@dataclasses.dataclass(frozen=True)
class BoutTable:
    """K bouts, ordered by pairing and number."""

    antagonists: tuple[str, ...]
    """References of the antagonists' pool, in the order of the tournament."""
    protagonists: tuple[str, ...]
    antagonist: NDArray[np.int32]
    """int32[K], who played: index into ``antagonists``."""
    protagonist: NDArray[np.int32]
    """int32[K], index into ``protagonists``."""
    bout: NDArray[np.int32]
    """int32[K], number within its pairing."""
    seed: NDArray[np.int64]
    """int64[K], seed of the batch the bout was played in."""
    score: NDArray[np.float32]
    """float32[K], the antagonist's total."""
    attack_steps: NDArray[np.int32]
    """int32[K], steps that paid a point."""
    penalty_steps: NDArray[np.int32]
    """int32[K], steps that cost ten."""
    camping_steps: NDArray[np.int32]
    """int32[K], steps that paid ten because the protagonist camped."""
    features: NDArray[np.float32]
    """float32[K, 2, 8], in the order of ``FEATURES``, antagonist first."""
    provenance: Provenance

    def __len__(self) -> int:
        """Return how many bouts there are."""
        return len(self.score)

    def label(self, reference: str) -> str:
        """Return a player's short name."""
        return self.provenance.labels.get(reference) or short_name(reference)

    def pairing(self, antagonist: int, protagonist: int) -> NDArray[np.intp]:
        """Return the rows of one pairing, by its players' indices."""
        return np.flatnonzero((self.antagonist == antagonist) & (self.protagonist == protagonist))


def short_name(reference: str) -> str:
    """Return what is left of a player reference that nobody has named."""
    kind, _, name = reference.partition(":")
    return name[:8] if kind == "sha256" else name


def save(table: BoutTable, path: Path) -> None:
    """Write the table, whole or not at all; the same table makes the same bytes.

    Raises:
        RiposteError: there is no space, or the folder cannot be written.
    """
    columns: dict[str, Any] = {
        "antagonist": _names(table.antagonist, table.antagonists),
        "protagonist": _names(table.protagonist, table.protagonists),
        "bout": table.bout,
        "seed": table.seed,
        "score": table.score,
        "attack_steps": table.attack_steps,
        "penalty_steps": table.penalty_steps,
        "camping_steps": table.camping_steps,
    }
    flat = table.features.reshape(len(table), len(FEATURE_COLUMNS))
    columns |= {name: np.ascontiguousarray(flat[:, k]) for k, name in enumerate(FEATURE_COLUMNS)}
    header = _Header(
        schema=SCHEMA,
        antagonists=table.antagonists,
        protagonists=table.protagonists,
        provenance=table.provenance,
    )
    made = pa.table(columns).replace_schema_metadata({METADATA_KEY: msgspec.json.encode(header)})
    buffer = io.BytesIO()
    pq.write_table(made, buffer, compression="zstd", write_page_checksum=True)
    atomic_write(path, buffer.getbuffer())


def load(path: Path) -> BoutTable:
    """Return the table in a file.

    Raises:
        RiposteError: it is not there, damaged, or no table of bouts.
    """
    if not path.is_file():
        raise RiposteError(f"there is no {path}; play the bouts with: riposte tournament RUN")
    try:
        found = table_of(path.read_bytes())
    except (OSError, pa.ArrowException, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise _damaged(path, reason) from None
    try:
        text = (found.schema.metadata or {})[METADATA_KEY]
        schema = msgspec.json.decode(text, type=dict[str, Any]).get("schema")
        if schema != SCHEMA:
            raise RiposteError(
                f"{path} has schema {schema}, this Riposte reads {SCHEMA}; "
                "write it again with: riposte tournament RUN"
            )
        header = msgspec.json.decode(text, type=_Header)
    except (KeyError, ValueError, RecursionError) as error:
        raise _damaged(path, f"its metadata says nothing of a tournament: {error}") from None
    return _table(found, path, header)


def _table(found: Any, path: Path, header: _Header) -> BoutTable:
    def numbers(name: str, dtype: Any) -> NDArray[Any]:
        if name not in found.column_names:
            raise _damaged(path, f"it has no column {name!r}")
        column = found.column(name)
        values = column.to_numpy() if not column.null_count else np.empty(0, object)
        if values.dtype != dtype:
            raise _damaged(path, f"column {name!r} has type {column.type} or gaps")
        return np.ascontiguousarray(values)

    features = np.stack([numbers(name, np.float32) for name in FEATURE_COLUMNS], axis=1)
    score = numbers("score", np.float32)
    if not (np.isfinite(features).all() and np.isfinite(score).all()):
        raise _damaged(path, "a score or a feature is not finite")

    def players(agent: str, pool: Sequence[str]) -> NDArray[np.int32]:
        if agent not in found.column_names:
            raise _damaged(path, f"it has no column {agent!r}")
        order = {name: k for k, name in enumerate(pool)}
        try:
            return np.array([order[name] for name in found.column(agent).to_pylist()], np.int32)
        except (KeyError, TypeError) as error:
            raise _damaged(path, f"its metadata names no {agent} {error}") from None

    return BoutTable(
        antagonists=header.antagonists,
        protagonists=header.protagonists,
        antagonist=players("antagonist", header.antagonists),
        protagonist=players("protagonist", header.protagonists),
        seed=numbers("seed", np.int64),
        score=score,
        **{name: numbers(name, np.int32) for name in COUNTS},
        features=features.reshape(len(features), len(AGENTS), len(FEATURES)),
        provenance=header.provenance,
    )


def _names(indices: NDArray[np.int32], references: Sequence[str]) -> Any:
    return pa.DictionaryArray.from_arrays(pa.array(indices), pa.array(references, pa.string()))


def _damaged(path: Path, why: str) -> RiposteError:
    return RiposteError(
        f"{path} is no table of bouts, or damaged ({why}); "
        "write it again from the ledger with: riposte tournament RUN"
    )
