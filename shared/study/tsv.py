r"""Tab-separated tables of rows that a struct declares; what is written is read back as it was.

One row is one line. ``n/a`` is nothing (as in BIDS); a backslash begins ``\t``, ``\n``, ``\r``,
``\\``, and ``n\/a`` for the three letters themselves.
"""

import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import msgspec

from shared.errors import StudyError
from shared.runtime.files import append_at, atomic_write, explain

R = TypeVar("R", bound=msgspec.Struct)

MAX_BYTES: Final = 256 << 20
"""Of one table."""
NOTHING: Final = "n/a"
_ESCAPES: Final = {"\\": "\\\\", "\t": "\\t", "\n": "\\n", "\r": "\\r"}
_SPECIAL: Final = re.compile(r"[\\\t\n\r]")
_ESCAPED: Final = re.compile(r"\\(.)|\\\Z", re.DOTALL)
_MEANT: Final = {"\\": "\\", "t": "\t", "n": "\n", "r": "\r", "/": "/"}


def columns_of(type: type[msgspec.Struct]) -> tuple[str, ...]:
    """Return the names of the columns of a kind of row."""
    return tuple(field.encode_name for field in msgspec.structs.fields(type))


def write_table(path: Path, rows: Sequence[R], type: type[R]) -> None:
    """Write a table, whole or not at all.

    Raises:
        RiposteError: there is no space, or the file cannot be written; the old one is intact.
    """
    atomic_write(path, encode_table(rows, type))


def encode_table(rows: Sequence[R], type: type[R]) -> bytes:
    """Return the bytes of a table: a line of names, and a line a row."""
    names = columns_of(type)
    lines = ["\t".join(names), *(_line(row, names) for row in rows)]
    return "".join(f"{line}\n" for line in lines).encode()


def read_table(path: Path, type: type[R]) -> list[R]:
    """Return the rows of a table; none where there is no such file.

    Raises:
        StudyError: it cannot be read, or a line does not fit: names line and column.
    """
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        return []
    except OSError as error:
        raise StudyError(f"cannot read {path}: {error.strerror or error}") from error
    return decode_table(data, str(path), type)


def decode_table(data: bytes, name: str, type: type[R]) -> list[R]:
    """Return the rows in the bytes of a table; what follows the last line feed was cut short.

    Args:
        data: the file's bytes.
        name: of the file, for messages.
        type: of a row; columns that it does not know are left out.

    Raises:
        StudyError: a line does not fit: names line and column.
    """
    if len(data) > MAX_BYTES:
        raise StudyError(f"{name}: too long, at most {MAX_BYTES} bytes are read")
    try:
        text = data[: data.rfind(b"\n") + 1].decode("utf-8")
    except UnicodeDecodeError as error:
        raise StudyError(f"{name} is not UTF-8 text (byte {error.start})") from None
    lines = text.replace("\r\n", "\n").split("\n")[:-1]
    if not lines:
        return []
    header = lines[0].split("\t")
    cells: list[_Cell] = []
    for field in msgspec.structs.fields(type):
        column = field.encode_name
        if header.count(column) != 1:
            raise StudyError(
                f"{name}:1: column {column!r} must be there once, and is {header.count(column)} "
                f"times; expected are {', '.join(columns_of(type))}"
            )
        cells.append(_Cell(header.index(column), column, field.type))
    rows: list[R] = []
    for number, line in enumerate(lines[1:], start=2):
        texts = line.split("\t")
        if len(texts) != len(header):
            raise StudyError(
                f"{name}:{number}: {len(texts)} cells, expected {len(header)} as in the first line"
            )
        rows.append(type(**{cell.name: _read(cell, texts, f"{name}:{number}") for cell in cells}))
    return rows


class RowLog:
    """A table that grows by a row at a time: heart rate. One process writes it."""

    def __init__(self, path: Path, type: type[msgspec.Struct]) -> None:
        """Open or begin a table; a last row that was cut short is dropped.

        Raises:
            RiposteError: it cannot be written.
        """
        self.path = path
        self._names = columns_of(type)
        self._file: int | None = None
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
            self._size = _whole_lines(self._file)
        except OSError as error:
            self.close()
            raise explain(error, path, 0) from error
        if not self._size:
            self._append("\t".join(self._names))

    def write(self, row: msgspec.Struct) -> None:
        """Add a row.

        Raises:
            RiposteError: there is no space, or the file cannot be written; it is as it was.
            ValueError: the table is closed.
        """
        self._append(_line(row, self._names))

    def sync(self) -> None:
        """Make all rows durable."""
        if self._file is not None:
            os.fsync(self._file)

    def close(self) -> None:
        """Close the table; a second call does nothing."""
        if self._file is not None:
            os.close(self._file)
            self._file = None

    def __enter__(self) -> "RowLog":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _append(self, line: str) -> None:
        if self._file is None:
            raise ValueError(f"{self.path.name} is closed")
        data = f"{line}\n".encode()
        self._size = append_at(self._file, self._size, data, self.path, is_synced=False)


def _whole_lines(descriptor: int) -> int:
    """Cut an open file after its last line feed; return its size."""
    size = os.fstat(descriptor).st_size
    end = size
    while end:
        begin = max(0, end - 65536)
        found = os.pread(descriptor, end - begin, begin).rfind(b"\n")
        end = begin if found < 0 else begin + found + 1
        if found >= 0:
            break
    if end < size:
        os.ftruncate(descriptor, end)
    return end


def _line(row: msgspec.Struct, names: Sequence[str]) -> str:
    return "\t".join(_cell(getattr(row, name)) for name in names)


def _cell(value: object) -> str:
    if value is None or value == "":
        return NOTHING
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        if value != value or value in (float("inf"), float("-inf")):
            raise ValueError(f"{value} is no number for a table: say None where there is none")
        return repr(value)
    if value == NOTHING:
        return "n\\/a"
    return _SPECIAL.sub(lambda found: _ESCAPES[found.group()], str(value))


class _Cell(NamedTuple):
    place: int
    name: str
    type: Any
    """What it holds: types are values here."""


def _read(cell: _Cell, texts: Sequence[str], line: str) -> object:
    text = texts[cell.place]
    try:
        return _value(text, cell.type)
    except (ValueError, KeyError):
        raise StudyError(
            f"{line}: column {cell.name!r} is {text[:80]!r}, expected {_spoken(cell.type)}"
        ) from None


def _value(text: str, annotation: object) -> object:
    """Return the value of a cell.

    Raises:
        ValueError: it is none.
        KeyError: it is none, either.
    """
    if annotation is str:
        plain = "" if text == NOTHING else text
        return _ESCAPED.sub(lambda found: _MEANT[found.group(1)], plain)
    if annotation == float | None or annotation == int | None:
        if text == NOTHING:
            return None
        annotation = float if annotation == float | None else int
    if annotation is bool:
        return {"true": True, "false": False}[text]
    if len(text) > 40 or not text.isascii() or "_" in text or text != text.strip():
        raise ValueError(text)
    if annotation is int:
        value = int(text)
        if abs(value) >= 2**63:
            raise ValueError(text)
        return value
    assert annotation is float, annotation
    number = float(text)
    if number - number != 0.0:
        raise ValueError(text)
    return number


def _spoken(annotation: object) -> str:
    words = {bool: "true or false", int: "a whole number", float: "a number", str: "text"}
    for kind, word in words.items():
        if annotation is kind:
            return word
        if annotation == kind | None:
            return f"{word} or {NOTHING}"
    return str(annotation)
