"""What fuzzing has found stays mended: one test for each defect."""

import io
import sqlite3
from pathlib import Path

import msgspec
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from services.jobs.play.page import read_page_url
from services.jobs.train import pipeline
from services.league.events import RunFinished, decode_event
from services.league.ledger import Ledger, open_read_only
from services.robot_io.replays import read_replay
from services.robot_io.vive.poller import unpacked
from shared.errors import ConfigError, LedgerError, RiposteError
from shared.runtime.arrays import read_array
from shared.styles import bouts
from shared.telemetry.archive import MAX_CELLS, BoutInfo, Journal, load_bout, read_journal
from shared.telemetry.streams import BY_NAME
from tests.fuzz.entrances.tables import rows_of

DEEP = b'{"x": ' + b"[" * 100_000 + b"]" * 100_000 + b"}"


@pytest.mark.parametrize(
    "sql",
    [
        # counting the events of this one never ends
        "ALTER TABLE events RENAME TO old; CREATE VIEW events AS WITH RECURSIVE n (seq) AS "
        "(SELECT 1 UNION ALL SELECT seq + 1 FROM n) SELECT seq, 'x' AS kind, 'y' AS key, "
        "'{}' AS body, 0 AS at_ns FROM n",
        "CREATE TRIGGER t AFTER INSERT ON events BEGIN DELETE FROM events; END",
        "CREATE TABLE more (x)",
    ],
)
def test_a_ledger_that_is_more_than_its_table_is_refused(tmp_path: Path, sql: str) -> None:
    path = tmp_path / "league.db"
    ledger = Ledger(path)
    ledger.append([RunFinished()], 1)
    ledger.close()
    with sqlite3.connect(path) as connection:
        connection.executescript(sql)
    connection.close()
    with pytest.raises(LedgerError, match="expected the table events as the league makes it"):
        open_read_only(path)


def test_an_event_that_is_nested_deeply_is_a_value_error() -> None:
    with pytest.raises(ValueError, match="nested too deeply"):
        decode_event("run_finished", DEEP)


def test_offsets_beyond_a_journals_piece_are_not_believed(tmp_path: Path) -> None:
    """Arrow reads where they point, in whoever's memory that is."""
    stream = BY_NAME["robot"]
    journal = Journal(tmp_path, stream)
    journal.write(rows_of(stream))
    journal.close()
    path = tmp_path / "robot.arrows"
    whole = path.read_bytes()
    assert read_journal(path, stream) is not None
    offsets = np.arange(6, dtype="<i4").tobytes()  # of five texts of one letter
    at = whole.rindex(offsets)
    path.write_bytes(whole[: at + 20] + b"\xff\xff\xff\x7f" + whole[at + 24 :])
    assert read_journal(path, stream) is None


def test_a_small_table_of_many_rows_is_refused_unread(tmp_path: Path) -> None:
    rows = MAX_CELLS // 4
    zeros = pa.array(np.zeros(rows, bool))
    buffer = io.BytesIO()
    pq.write_table(pa.table({f"x{k}": zeros for k in range(5)}), buffer, compression="zstd")
    assert len(buffer.getvalue()) < rows // 50
    info = BoutInfo(bout="b", antagonist="a", protagonist="b", started_at_ns=0)
    (tmp_path / "bout.json").write_bytes(msgspec.json.encode(info))
    for name in ("bats.parquet", "bouts.parquet"):
        (tmp_path / name).write_bytes(buffer.getvalue())
    with pytest.raises(RiposteError, match="cells are read"):
        load_bout(tmp_path)
    with pytest.raises(RiposteError, match="cells are read"):
        bouts.load(tmp_path / "bouts.parquet")


@pytest.mark.parametrize("shape", ["(40000000,)", "((((", "(1,", "(-1,)", "(True,)"])
@pytest.mark.parametrize("kind", ["<f8", "<U1000000", "|O", "V0"])
def test_a_header_that_claims_what_is_not_there_takes_no_memory(
    tmp_path: Path, shape: str, kind: str
) -> None:
    text = f"{{'descr': {kind!r}, 'fortran_order': False, 'shape': {shape}, }}\n".encode()
    path = tmp_path / "bat.npy"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + bytes(64))
    with pytest.raises(ValueError):  # noqa: PT011
        read_array(path)
    with pytest.raises(ConfigError):
        read_replay(path)


@pytest.mark.parametrize("data", [DEEP, b'{"url": "\xff", "pid": 1}', b'{"url": "", "pid": 9e30}'])
def test_a_damaged_file_of_a_run_is_as_good_as_none(tmp_path: Path, data: bytes) -> None:
    for name in ("page.json", pipeline.FILE):
        (tmp_path / name).write_bytes(data)
    assert read_page_url(tmp_path) is None
    assert pipeline.read(tmp_path) == pipeline.Pipeline()
    assert unpacked(data) is None


def test_a_page_of_no_possible_process_is_no_page(tmp_path: Path) -> None:
    (tmp_path / "page.json").write_bytes(
        b'{"url": "http://127.0.0.1:1", "pid": 18446744073709551615}'
    )
    assert read_page_url(tmp_path) is None
