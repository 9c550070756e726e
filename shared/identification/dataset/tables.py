"""Tables of a data set, from Parquet or CSV: whole columns of numbers and a time in ns."""

# pyright: basic
# (pyarrow's types are partial)

import csv
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from shared.errors import IdentificationError
from shared.identification.dataset.types import Float64

TIME: Final = "t_ns"
MAX_BYTES: Final = 256 << 20
"""Of one file."""
MAX_ROWS: Final = 2_000_000
"""Of one file: half an hour at 1 kHz."""
MAX_CELLS: Final = 32_000_000
"""Numbers of one file."""
MAX_COLUMNS: Final = 1000
_BATCH: Final = 1 << 16
_TROUBLE: Final = (pa.ArrowException, OSError, ValueError, MemoryError, OverflowError)
"""What pyarrow raises on bytes that are not what they claim to be."""


@dataclass(frozen=True)
class Table:
    """The wanted columns of a file."""

    path: Path
    t_ns: NDArray[np.int64]
    """int64[N], as written."""
    columns: dict[str, Float64]
    """float64[N] by name, in the file's order; NaN where a cell is empty."""
    others: tuple[str, ...]
    """Columns that were not read."""


def read_table(path: Path, data: bytes, wanted: Callable[[str], bool]) -> Table:
    """Return the time and the wanted columns of a table.

    Args:
        path: of the file; its suffix says whether it is Parquet or CSV.
        data: its bytes.
        wanted: says of a column's name whether it is read.

    Raises:
        IdentificationError: it is no such file, it is too large, it has no ``t_ns`` or no rows, or
            a wanted column does not hold numbers.
    """
    source: _Parquet | _Csv
    source = _Csv(path, data) if path.suffix == ".csv" else _Parquet(path, data)
    names = source.names
    if len(names) > MAX_COLUMNS:
        raise IdentificationError(
            f"{path} has {len(names)} columns, at most {MAX_COLUMNS} are read"
        )
    for name in names:
        if names.count(name) > 1:
            raise IdentificationError(f"{path} has column {name!r} more than once: leave one")
    if TIME not in names:
        raise IdentificationError(
            f"{path} has no column {TIME!r}, only {', '.join(map(repr, names[:12]))}: "
            "write the time of each row as whole nanoseconds"
        )
    chosen = [name for name in names if name != TIME and wanted(name)]
    found = source.read([TIME, *chosen])
    if not len(found[TIME]):
        raise IdentificationError(f"{path} has no rows")
    others = tuple(name for name in names if name != TIME and name not in chosen)
    return Table(path, found[TIME], {name: found[name] for name in chosen}, others)


def check_size(path: Path, rows: int, columns: int) -> None:
    """Check that a table is not too large to be taken into memory.

    Raises:
        IdentificationError: it is.
    """
    if rows > MAX_ROWS or rows * columns > MAX_CELLS:
        raise IdentificationError(
            f"{path} has {rows} rows of {columns} columns, at most {MAX_ROWS} rows and "
            f"{MAX_CELLS} numbers are read: cut it into several trajectories, or thin it out"
        )


class _Parquet:
    def __init__(self, path: Path, data: bytes) -> None:
        self._path = path
        try:
            self._file = pq.ParquetFile(
                pa.BufferReader(data), pre_buffer=False, thrift_string_size_limit=1 << 20,
                thrift_container_size_limit=1 << 16, schema_depth_limit=8,
                page_checksum_verification=True, arrow_extensions_enabled=False,
            )  # fmt: skip
            self.names: list[str] = list(self._file.schema_arrow.names)
        except _TROUBLE as error:
            raise _unreadable(path, error) from None

    def read(self, names: list[str]) -> dict[str, NDArray[Any]]:
        schema = self._file.schema_arrow
        for name in names:
            _check_type(self._path, name, schema.field(name).type)
        claimed = self._file.metadata.num_rows
        check_size(self._path, claimed, len(names))
        parts: dict[str, list[Any]] = {name: [] for name in names}
        rows = 0
        try:
            batches = self._file.iter_batches(
                min(_BATCH, max(1, claimed)), columns=names, use_threads=False
            )
            for batch in batches:
                rows += batch.num_rows
                check_size(self._path, rows, len(names))
                for name in names:
                    parts[name].append(batch.column(name))
        except _TROUBLE as error:
            raise _unreadable(self._path, error) from None
        return {
            name: _numbers(self._path, name, pa.chunked_array(parts[name], schema.field(name).type))
            for name in names
        }


class _Csv:
    def __init__(self, path: Path, data: bytes) -> None:
        self._path, self._data = path, data
        head = data[: 1 << 20].split(b"\n", 1)[0]
        try:
            line = head.decode("utf-8-sig").strip()
            self.names = [name.strip() for name in next(csv.reader([line]), [])]
        except (UnicodeDecodeError, csv.Error) as error:
            raise _unreadable(path, error) from None
        if len(self.names) == 1 and any(mark in line for mark in ";\t"):
            raise IdentificationError(
                f"{path} has no commas in its first line: separate columns by commas, "
                "and write numbers with a decimal point"
            )

    def read(self, names: list[str]) -> dict[str, NDArray[Any]]:
        check_size(
            self._path, max(self._data.count(b"\n"), self._data.count(b"\r")) - 1, len(names)
        )
        try:
            table = self._table(names, pa.int64())
        except pa.ArrowInvalid:  # times with a decimal point; what is wrong is said below
            try:
                table = self._table(names, pa.float64())
            except _TROUBLE as error:
                raise _unreadable(self._path, error) from None
        except _TROUBLE as error:
            raise _unreadable(self._path, error) from None
        check_size(self._path, table.num_rows, len(names))
        return {name: _numbers(self._path, name, table.column(name)) for name in names}

    def _table(self, names: list[str], time: Any) -> Any:
        return pyarrow.csv.read_csv(
            pa.BufferReader(self._data),
            read_options=pyarrow.csv.ReadOptions(
                use_threads=False, skip_rows=1, column_names=self.names
            ),
            convert_options=pyarrow.csv.ConvertOptions(
                include_columns=names,
                column_types={name: time if name == TIME else pa.float64() for name in names},
            ),
        )


def _check_type(path: Path, name: str, kind: Any) -> None:
    is_time = name == TIME and (pa.types.is_timestamp(kind) or pa.types.is_duration(kind))
    if not (
        is_time or pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_null(kind)
    ):
        raise IdentificationError(f"{path}: column {name!r} holds {kind}, expected numbers")


def _numbers(path: Path, name: str, chunks: Any) -> NDArray[Any]:
    if name != TIME:
        try:
            made = chunks.cast(pa.float64()).to_numpy()
        except _TROUBLE as error:
            raise IdentificationError(
                f"{path}: column {name!r} holds numbers that float64 cannot ({_first(error)})"
            ) from None
        return np.ascontiguousarray(made, np.float64)
    if chunks.null_count:
        row = int(np.argmax(chunks.is_null().to_numpy(zero_copy_only=False)))
        raise IdentificationError(
            f"{path}: column {TIME!r}, row {row} is empty: every row needs its time"
        )
    try:
        if pa.types.is_timestamp(chunks.type):
            chunks = chunks.cast(pa.timestamp("ns", chunks.type.tz))
        elif pa.types.is_duration(chunks.type):
            chunks = chunks.cast(pa.duration("ns"))
        return np.ascontiguousarray(chunks.cast(pa.int64()).to_numpy(), np.int64)
    except _TROUBLE:
        row, value = _not_whole(chunks)
        raise IdentificationError(
            f"{path}: column {TIME!r}, row {row} is {value}, expected whole nanoseconds: "
            "multiply seconds by 1e9 and round"
        ) from None


def _not_whole(chunks: Any) -> tuple[int, Any]:
    """Return the first row whose time is no whole number, and what it is."""
    row = 0
    if pa.types.is_floating(chunks.type):
        values = chunks.to_numpy().astype(np.float64)
        row = int(np.argmax((values != np.round(values)) | ~(np.abs(values) < 2.0**63)))
    return row, chunks[row]


def _unreadable(path: Path, error: BaseException) -> IdentificationError:
    kind = "CSV" if path.suffix == ".csv" else "Parquet"
    return IdentificationError(f"{path} is no {kind} table, or damaged ({_first(error)})")


def _first(error: BaseException) -> str:
    text = str(error).splitlines()
    return text[0][:300] if text else type(error).__name__
