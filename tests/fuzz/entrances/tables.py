"""Tables: Parquet, Arrow, CSV and NumPy files of data sets, bouts and recordings."""

import functools
import io
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from services.robot_io.heart_rate.replay import HeartRateReplay
from services.robot_io.replays import read_replay
from shared.clock import ManualClock
from shared.errors import ConfigError, IdentificationError, RiposteError
from shared.identification.dataset.tables import read_table
from shared.styles import bouts
from shared.telemetry.archive import BoutInfo, Journal, load_bout, parquet_of, read_journal
from shared.telemetry.streams import DTYPES, STREAMS, Rows, Stream
from tests.fuzz import formats, mutate
from tests.fuzz.target import MIB, Bound, Target, from_file
from tests.unit.styles.making import table

ROWS = 5
TABLE = Bound(256, 320 * MIB)
"""A table may have 32 million numbers, however small it was made."""
INFO = BoutInfo(bout="b", antagonist="person", protagonist="scripted:guard", started_at_ns=0)
BOMB_ROWS = 3_000_000


def targets(folder: Path) -> list[Target]:
    """Return all of them."""
    return [*_dataset(), *_archive(folder), *_bouts(folder), *_numpy(folder)]


def parquet(columns: dict[str, Any], metadata: dict[bytes, bytes] | None = None) -> bytes:
    """Return a Parquet file with checksums."""
    made = pa.table(columns).replace_schema_metadata(metadata)
    buffer = io.BytesIO()
    pq.write_table(made, buffer, compression="zstd", write_page_checksum=True)
    return buffer.getvalue()


@functools.cache
def bomb() -> bytes:
    """Return a few kilobytes of Parquet that say they are 36 million numbers, and are."""
    buffer = io.BytesIO()
    no, zero = pa.array(np.zeros(BOMB_ROWS, bool)), pa.array(np.zeros(BOMB_ROWS, np.int8))
    piece = pa.table({"t_ns": zero, **{f"x{k}": no for k in range(11)}})
    pq.write_table(piece, buffer, compression="zstd", write_statistics=False)
    return buffer.getvalue()


def _dataset() -> list[Target]:
    columns = {"t_ns": np.arange(ROWS) * 10_000_000, "x": np.linspace(0.0, 1.0, ROWS),
               "q_elbow_flex": np.zeros(ROWS)}  # fmt: skip
    text = b"t_ns,x,y\n" + b"".join(b"%d,0.5,%d\n" % (k * 10**7, k) for k in range(ROWS))

    def reader(name: str) -> Callable[[bytes], object]:
        return lambda data: read_table(Path(name), data, lambda _: True)

    return [
        Target("tables/data.parquet", reader("joints.parquet"),
               (parquet(columns), parquet({**columns, "i": np.arange(ROWS, dtype=np.int8)}),
                bomb()),
               _tabular, (IdentificationError,),
               ("shared.identification.dataset.tables:_Parquet.__init__",
                "shared.identification.dataset.tables:_Parquet.read"), TABLE),
        Target("tables/data.csv", reader("joints.csv"), (text, b"\xef\xbb\xbf" + text), _csv,
               (IdentificationError,), ("shared.identification.dataset.tables:_Csv.__init__",
                                        "shared.identification.dataset.tables:_Csv.read"), TABLE),
    ]  # fmt: skip


def _tabular(random: Random, data: bytes) -> bytes:
    """Break a Parquet file: bytes, most of all of its footer, or a valid one of odd columns."""
    way = random.random()
    if way < 0.4:
        return mutate.raw(random, data[: mutate.LARGEST])
    if way < 0.6:
        return _footer(random, data)
    return _odd_table(random, data)


def _footer(random: Random, data: bytes) -> bytes:
    length = int.from_bytes(data[-8:-4], "little")
    start = len(data) - 8 - length
    foot = mutate.raw(random, data[start:-8])
    return data[:start] + foot + len(foot).to_bytes(4, "little") + data[-4:]


def _odd_table(random: Random, data: bytes) -> bytes:
    found = pq.read_table(io.BytesIO(data)).slice(0, 100)
    columns = {name: found.column(name).combine_chunks() for name in found.column_names}
    length = found.num_rows
    odd: list[Callable[[], Any]] = [
        lambda: pa.array([None] * length), lambda: pa.array(["x"] * length),
        lambda: pa.array([b"\xff"] * length), lambda: pa.array([[1.0]] * length),
        lambda: pa.array([float("nan")] * length), lambda: pa.array([2**63 - 1] * length),
        lambda: pa.array([{"a": 1}] * length), lambda: pa.array([True] * length),
        lambda: pa.array(np.zeros(length, np.float16)), lambda: pa.array([[]] * length),
        lambda: pa.array([-(2**63)] * length), lambda: pa.array([1e300] * length),
        lambda: pa.array([0] * length, pa.timestamp("s")),
        lambda: pa.array([1] * length, pa.date32()),
        lambda: pa.DictionaryArray.from_arrays(pa.array([0] * length), pa.array(["a"])),
        lambda: pa.array([None, *[1] * length][:length], pa.decimal128(38, 10)),
    ]  # fmt: skip
    name = random.choice(list(columns))
    way = random.randrange(4)
    if way == 0:
        columns.pop(name)
    elif way == 1:
        columns[random.choice(("", "extra", "\x00", "q_", "x" * 1000))] = columns[name]
    else:
        columns[name] = random.choice(odd)()
    metadata = dict(found.schema.metadata or {})
    for key in metadata:
        if random.random() < 0.3:
            metadata[key] = formats.json_text(random, metadata[key])
    try:
        return parquet(columns, metadata)
    except (pa.ArrowException, UnicodeError):
        return _footer(random, data)


def _csv(random: Random, data: bytes) -> bytes:
    if random.random() < 0.5:
        return mutate.raw(random, data)
    lines = data.split(b"\n")
    size = mutate.size_of(random, 1 << 12)
    odd = random.choice((
        b"," * size, b'"' * size, b'"' + b"x" * size, b"1,2", b"nan,inf,-inf",
        b"9" * size + b",1,1",
        b"1e999,1,1", b"t_ns,t_ns,x", b"\x00,1,1", b"1;2;3", b"0x10,1,1", b"1,1,1\r" * (size % 100),
    ))  # fmt: skip
    lines.insert(random.randrange(len(lines)), odd)
    return b"\n".join(lines)


def rows_of(stream: Stream) -> Rows:
    """Return some rows of a stream of a bout."""
    columns: dict[str, Any] = {}
    for column in stream.columns:
        shape = (ROWS, column.width) if column.width else (ROWS,)
        if column.kind == "text":
            columns[column.name] = np.array(["a"] * ROWS, object)
        else:
            columns[column.name] = np.ones(shape, DTYPES[column.kind])
    return Rows(columns)


def _archive(folder: Path) -> list[Target]:
    home = folder / "bout"
    home.mkdir(parents=True, exist_ok=True)
    made: list[Target] = [
        Target(
            "tables/bout.json", from_file(home / "bout.json", functools.partial(load_bout, home)),
            (msgspec.json.encode(INFO),), formats.json_text, (RiposteError,),
            ("shared.telemetry.archive:read_info",),
        )
    ]  # fmt: skip
    for stream in STREAMS:
        rows, path = rows_of(stream), home / f"{stream.name}.arrows"
        path.unlink(missing_ok=True)
        journal = Journal(home, stream)
        journal.write(rows)
        journal.write(rows)
        journal.close()
        pieces = path.read_bytes()
        path.unlink()
        own = folder / f"bout-{stream.name}"
        own.mkdir(exist_ok=True)
        (own / "bout.json").write_bytes(msgspec.json.encode(INFO))
        made += [
            Target(
                f"tables/bout/{stream.name}.parquet",
                from_file(own / f"{stream.name}.parquet", functools.partial(load_bout, own)),
                (parquet_of(stream, rows, INFO), *_bombs(stream)), _tabular, (RiposteError,),
                ("shared.telemetry.archive:_read_parquet",), TABLE,
            ),
            Target(
                f"tables/bout/{stream.name}.arrows",
                from_file(path, functools.partial(read_journal, path, stream)),
                (pieces,), mutate.raw, (RiposteError,),
                ("shared.telemetry.archive:read_journal",), TABLE,
            ),
        ]  # fmt: skip
    return made


def _bouts(folder: Path) -> list[Target]:
    path = folder / "bouts.parquet"
    bouts.save(table(), path)
    return [Target("tables/bouts.parquet", from_file(path, functools.partial(bouts.load, path)),
                   (path.read_bytes(),), _tabular, (RiposteError,), ("shared.styles.bouts:load",),
                   TABLE)]  # fmt: skip


def _bombs(stream: Stream) -> tuple[bytes, ...]:
    return (bomb(),) if stream is STREAMS[0] else ()


def npy(array: np.ndarray[Any, Any]) -> bytes:
    """Return a .npy file."""
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=array.dtype == object)
    return buffer.getvalue()


def _numpy(folder: Path) -> list[Target]:
    bat, heart, text = folder / "bat.npy", folder / "heart.npy", folder / "heart.csv"
    row = np.zeros((4, 14))
    row[:, 0], row[:, 4] = np.arange(4), 1.0
    clock = ManualClock()
    pickled = npy(np.array([print, {}], object))
    table = b"seconds,beats_per_minute,rr_ms\n0,60,1000\n1.5,61,990 980\n"
    rates = npy(np.array([[0.0, 60.0], [1.0, 61.0]]))
    return [
        Target("tables/bat.npy", from_file(bat, functools.partial(read_replay, bat)),
               (npy(row), pickled), _npy, (ConfigError,), ("services.robot_io.replays:_file",)),
        Target("tables/heart.npy",
               from_file(heart, functools.partial(HeartRateReplay.load, heart, clock)),
               (rates, pickled), _npy, (ConfigError,),
               ("services.robot_io.heart_rate.replay:HeartRateReplay.load",)),
        Target("tables/heart.csv",
               from_file(text, functools.partial(HeartRateReplay.load, text, clock)),
               (table,), _csv, (ConfigError,),
               ("services.robot_io.heart_rate.replay:_read_table",)),
    ]  # fmt: skip


def _npy(random: Random, data: bytes) -> bytes:
    """Break a .npy file: its bytes, or the Python literal in its header."""
    if random.random() < 0.5:
        return mutate.raw(random, data)
    shape = random.choice(
        (
            "(1000000000,)",
            "(4, 10000000)",
            "(-1,)",
            "()",
            "(2, 7)",
            "(True,)",
            "(4, 14" + ", 1" * 70 + ")",
            "(" * 300,
            "__import__('os')",
            "(9" * 9,
        )
    )
    kind = random.choice(("<f8", "|O", "<U1000000", "V8", ">f8", "<f2", "<M8[s]", "x", "<c16",
                          "[('a', '<f8')]"))  # fmt: skip
    text = f"{{'descr': {kind!r}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data[128:]
