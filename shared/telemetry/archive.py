"""The archive of live bouts: a folder a bout, a Parquet file a stream, and ``bout.json``.

The columns, their units and what they mean are those of ``shared/telemetry/streams.py``; units and
meaning are in the files too, as metadata of their columns, and who played, by which rules and in
which version is in every file and in ``bout.json``. Nothing of it needs Riposte to be read.

While a bout goes on, its rows are in journals (``bats.arrows``, the Arrow stream format), which
grow by whole pieces: whoever is killed leaves all pieces but the one it gathers. ``load_bout``
reads journals and finished files alike.
"""

# pyright: basic
# (pyarrow's types are partial)

import contextlib
import dataclasses
import functools
import io
import os
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from shared.errors import RiposteError
from shared.messages.message import Array
from shared.messages.training import AGENTS
from shared.telemetry.streams import (
    BATS,
    BY_NAME,
    DTYPES,
    TIME,
    Column,
    Rows,
    Stream,
)

SCHEMA = 1
"""Of the folder; goes up when a column changes its meaning."""
INFO_FILE = "bout.json"
FINISHED, JOURNAL = ".parquet", ".arrows"
METADATA_KEY = b"riposte"
MAX_CELLS = 32_000_000
"""Of one Parquet file: three hours of a bout."""
ARROW_TYPES: dict[str, Any] = {
    "float": pa.float64(), "int": pa.int64(), "bool": pa.bool_(), "text": pa.string(),
}  # fmt: skip
ENCODINGS = {"float": "BYTE_STREAM_SPLIT", "int": "DELTA_BINARY_PACKED"}
"""Halve the size of what changes a little from row to row."""
Outcome = Literal["running", "finished", "void", "interrupted"]


class StreamInfo(msgspec.Struct, frozen=True, kw_only=True):
    """How complete a stream is."""

    rows: int = 0
    dropped: int = 0
    """Messages that arrived and were thrown away because the recorder was behind."""
    missing: int = 0
    """Ticks between the first and the last row that have none, whoever lost them."""
    rate_hz: float = 0.0
    """Rows a second, from the first to the last."""


class BoutInfo(msgspec.Struct, frozen=True, kw_only=True):
    """What ``bout.json`` says."""

    schema: int = SCHEMA
    bout: str
    antagonist: str
    """Player reference, or ``person``."""
    protagonist: str
    outcome: Outcome = "running"
    """``running`` in a folder whose bout goes on, or whose recorder was killed."""
    reason: str = ""
    """Why it is void or was interrupted."""
    score: float = 0.0
    """The referee's last word: the antagonist's points."""
    steps: int = 0
    attack_steps: int = 0
    penalty_steps: int = 0
    camping_steps: int = 0
    missed_ticks: int = 0
    from_step: int = 0
    """Steps that were judged before the recorder came; 0 where it was there from the start."""
    started_at_ns: int
    """Wall clock of the first row that belongs to the bout."""
    ended_at_ns: int = 0
    run: str = ""
    """Name of the run's folder."""
    version: str = ""
    """Of Riposte."""
    commit: str = ""
    model: str = ""
    """Hash of the simulator model the recorder was given."""
    observation_schema: str = ""
    action_schema: str = ""
    site: str = ""
    """SHA-256 of the site file and of what the command line said over it; 64 hex digits."""
    robot_io_boot: str = ""
    control_timestep: float = 0.01
    """(s)."""
    sections: dict[str, Any] = {}
    """Of the site as resolved: ``game``, ``sim``, ``action``."""
    streams: dict[str, StreamInfo] = {}


@dataclasses.dataclass(frozen=True)
class ArchivedBout:
    """A bout as it was recorded."""

    folder: Path
    info: BoutInfo
    streams: dict[str, Rows]
    """By name; a stream that said nothing is not there."""

    def unit(self, stream: str, column: str) -> str:
        """Return the unit of a column; empty for text.

        Raises:
            KeyError: there is no such stream or column.
        """
        return BY_NAME[stream].column(column).unit

    def seconds(self, stream: str) -> Array:
        """Return float64[T], the times of a stream's rows since the bout was started (s)."""
        return 1e-9 * (self.streams[stream][TIME] - self.info.started_at_ns)

    def bats(self) -> Array:
        """Return float64[T, 2, 13] as ``BatStates.bats``: m, w x y z, m/s, rad/s; world frame."""
        rows = self._stream(BATS.name)
        parts = ("position", "orientation", "velocity", "angular_velocity")
        sides = [
            np.concatenate([rows[f"{agent}_{part}"] for part in parts], axis=1) for agent in AGENTS
        ]
        return np.stack(sides, axis=1)

    def _stream(self, name: str) -> Rows:
        if name not in self.streams:
            raise RiposteError(f"{self.folder} has no {name}: nothing of it was recorded")
        return self.streams[name]


class Journal:
    """A stream of a bout that goes on: pieces of rows, each whole in the file once it is written.

    A killed process loses none of them; what a failing power supply loses is up to the disk.
    """

    def __init__(self, folder: Path, stream: Stream) -> None:
        """Begin the file.

        Raises:
            OSError: it is there already, or the folder cannot be written.
        """
        self.stream = stream
        self.path = folder / f"{stream.name}{JOURNAL}"
        self.rows = 0
        self._size = 0
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC
        self._descriptor = os.open(self.path, flags, 0o644)
        self._buffer = io.BytesIO()
        self._writer = pa.ipc.new_stream(self._buffer, _schema(stream))

    def write(self, rows: Rows) -> None:
        """Append rows.

        Raises:
            OSError: no space left; what was written before is whole.
        """
        self._writer.write_batch(_batch(self.stream, rows))
        piece = memoryview(self._buffer.getvalue())
        self._buffer.seek(0)
        self._buffer.truncate()
        size = len(piece)
        try:
            while piece:
                piece = piece[os.write(self._descriptor, piece) :]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self._size)
            raise
        self._size += size
        self.rows += len(rows)

    def close(self) -> None:
        """Close the file; it stays."""
        os.close(self._descriptor)


def release_buffers() -> None:
    """Give the memory that files were made in back to the system: Arrow's allocator keeps it."""
    pa.default_memory_pool().release_unused()


def parquet_of(stream: Stream, rows: Rows, info: BoutInfo) -> bytes:
    """Return the finished file of a stream."""
    schema = _schema(stream).with_metadata({METADATA_KEY: msgspec.json.encode(info)})
    table = pa.Table.from_batches([_batch(stream, rows)]).cast(_schema(stream))
    table = table.replace_schema_metadata(schema.metadata)
    texts: Any = [column.name for column in stream.columns if column.kind == "text"]
    buffer = io.BytesIO()
    pq.write_table(
        table, buffer, compression="zstd", compression_level=6, write_page_checksum=True,
        use_dictionary=texts,
        column_encoding={_leaf(column): ENCODINGS[column.kind] for column in stream.columns
                         if column.kind in ENCODINGS},
    )  # fmt: skip
    return buffer.getvalue()


def read_journal(path: Path, stream: Stream) -> Rows | None:
    """Return the whole pieces of a journal, None where it has none.

    Raises:
        RiposteError: it cannot be read, or is of another kind.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise RiposteError(f"cannot read {path}: {error.strerror or error}") from None
    batches: list[Any] = []
    with contextlib.suppress(pa.ArrowException, OSError, EOFError):  # a piece that is not whole
        reader = pa.ipc.open_stream(pa.BufferReader(data))
        while True:
            try:
                batch = reader.read_next_batch()
            except StopIteration:
                break
            batch.validate(full=True)  # Arrow itself believes every offset in it
            batches.append(batch)
    if not batches:
        return None
    return _rows(pa.Table.from_batches(batches), stream, path)


def load_bout(folder: str | os.PathLike[str]) -> ArchivedBout:
    """Return an archived bout, finished or not.

    Raises:
        RiposteError: the folder is no archived bout, of another schema, or damaged.
    """
    folder = Path(folder)
    info = read_info(folder)
    streams: dict[str, Rows] = {}
    for name, stream in BY_NAME.items():
        finished, journal = folder / f"{name}{FINISHED}", folder / f"{name}{JOURNAL}"
        rows: Rows | None = None
        if finished.exists():
            rows = _read_parquet(finished, stream)
        elif journal.exists():
            rows = read_journal(journal, stream)
        if rows is not None:
            streams[name] = rows
    return ArchivedBout(folder, info, streams)


def read_info(folder: Path) -> BoutInfo:
    """Return what ``bout.json`` says.

    Raises:
        RiposteError: it is not there, damaged, or of another schema.
    """
    path = folder / INFO_FILE
    try:
        text = path.read_bytes()
        schema = msgspec.json.decode(text, type=dict[str, Any]).get("schema")
        if schema != SCHEMA:
            raise RiposteError(f"{path} has schema {schema}, this Riposte reads {SCHEMA}")
        return msgspec.json.decode(text, type=BoutInfo)
    except OSError as error:
        raise RiposteError(
            f"{folder} is no archived bout (no {INFO_FILE}: {error.strerror or error}); "
            "name a folder in RUN/bouts"
        ) from None
    except (ValueError, RecursionError) as error:
        raise RiposteError(f"{path} is damaged: {error}") from None


def archived_bouts(folder: Path) -> list[Path]:
    """Return the folders of the archived bouts of a run, oldest first.

    Raises:
        RiposteError: one of them is damaged.
    """
    found = [path.parent for path in (folder / "bouts").glob(f"*/{INFO_FILE}")]
    return sorted(found, key=lambda path: (read_info(path).started_at_ns, path.name))


def missing_ticks(ticks: Array) -> int:
    """Return how many ticks between the first and the last are not there.

    Args:
        ticks: int64[T]; one below that before it is another boot's first.
    """
    steps = np.diff(ticks)
    return int(np.maximum(steps[steps > 0] - 1, 0).sum())


def _read_parquet(path: Path, stream: Stream) -> Rows:
    try:
        found = table_of(path.read_bytes())
    except (OSError, pa.ArrowException, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise _damaged(path, reason) from None
    return _rows(found, stream, path)


def table_of(data: bytes) -> Any:
    """Return the table in a Parquet file that anybody may have made.

    Raises:
        OSError, pyarrow.ArrowException, ValueError: it is none, it is damaged, or too large.
    """
    # In this thread: a pool that is still alive when the interpreter ends can abort it.
    file = pq.ParquetFile(
        pa.BufferReader(data), pre_buffer=False, thrift_string_size_limit=1 << 20,
        thrift_container_size_limit=1 << 16, page_checksum_verification=True,
    )  # fmt: skip
    rows, columns = file.metadata.num_rows, file.metadata.num_columns
    if rows * columns > MAX_CELLS:  # a few bytes can say a billion rows
        raise ValueError(f"{rows} rows of {columns} columns, at most {MAX_CELLS} cells are read")
    table = file.read(use_threads=False)
    table.validate(full=True)
    return table


def _leaf(column: Column) -> str:
    return f"{column.name}.list.element" if column.width else column.name


@functools.cache
def _schema(stream: Stream) -> Any:
    return pa.schema([_field(column) for column in stream.columns])


def _field(column: Column) -> Any:
    kind = ARROW_TYPES[column.kind]
    told = {"unit": column.unit, "about": column.about}
    kind = pa.list_(kind, column.width) if column.width else kind
    return pa.field(column.name, kind, nullable=False, metadata=told)


def _batch(stream: Stream, rows: Rows) -> Any:
    arrays = []
    for column in stream.columns:
        values = rows[column.name]
        flat = pa.array(values.reshape(-1), ARROW_TYPES[column.kind])
        arrays.append(
            pa.FixedSizeListArray.from_arrays(flat, column.width) if column.width else flat
        )
    return pa.RecordBatch.from_arrays(
        [array.cast(field.type) for array, field in zip(arrays, _schema(stream), strict=True)],
        schema=_schema(stream),
    )


def _rows(table: Any, stream: Stream, path: Path) -> Rows:
    columns: dict[str, Array] = {}
    try:
        names = table.column_names
    except UnicodeDecodeError as error:
        raise _damaged(path, f"the name of a column is {error}") from None
    for column in stream.columns:
        if column.name not in names:
            raise _damaged(path, f"it has no column {column.name!r}")
        columns[column.name] = _numbers(table.column(column.name), column, path)
    return Rows(columns)


def _numbers(chunks: Any, column: Column, path: Path) -> Array:
    found = chunks.combine_chunks()
    if isinstance(found, pa.ChunkedArray):
        found = pa.concat_arrays(found.chunks) if found.num_chunks else pa.array([], found.type)
    kind = ARROW_TYPES[column.kind]
    wanted = pa.list_(kind, column.width) if column.width else kind
    is_like = found.type == wanted or (
        column.width and pa.types.is_fixed_size_list(found.type)
        and (found.type.list_size, found.type.value_type) == (column.width, kind)
    )  # fmt: skip
    if not is_like or found.null_count:
        raise _damaged(path, f"column {column.name!r} has type {found.type}, or gaps")
    if column.kind == "text":
        made = np.empty(len(found), object)
        made[:] = found.to_pylist()
        return made
    flat = found.flatten() if column.width else found
    values = flat.to_numpy(zero_copy_only=False).astype(DTYPES[column.kind], copy=False)
    return values.reshape(-1, column.width) if column.width else values


def _damaged(path: Path, why: str) -> RiposteError:
    return RiposteError(f"{path} is no stream of an archived bout, or damaged ({why})")
