"""Whatever a stream's rows are, the archive gives them back bit for bit."""

import tempfile
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from shared.telemetry.archive import BoutInfo, Journal, load_bout, parquet_of, read_journal
from shared.telemetry.streams import DTYPES, STREAMS, Rows, Stream

INFO = BoutInfo(bout="b", antagonist="person", protagonist="scripted:guard", started_at_ns=0)
ELEMENTS = {
    "float": st.floats(width=64, allow_nan=True, allow_infinity=True),
    "int": st.integers(-(2**63), 2**63 - 1),
    "bool": st.booleans(),
}


@st.composite
def pieces(draw: st.DrawFn) -> tuple[Stream, list[Rows]]:
    stream = draw(st.sampled_from(STREAMS))
    made: list[Rows] = []
    for _ in range(draw(st.integers(1, 3))):
        length = draw(st.integers(1, 4))
        columns = {}
        for column in stream.columns:
            if column.kind == "text":
                texts = st.lists(st.text(max_size=8), min_size=length, max_size=length)
                columns[column.name] = np.array([*draw(texts), None], object)[:-1]
                continue
            shape = (length, column.width) if column.width else (length,)
            elements = ELEMENTS[column.kind]
            columns[column.name] = draw(
                hnp.arrays(DTYPES[column.kind], shape, elements=elements, fill=elements)
            )
        made.append(Rows(columns))
    return stream, made


def assert_same(found: Rows | None, expected: Rows, stream: Stream) -> None:
    assert found is not None
    for column in stream.columns:
        one, other = found[column.name], expected[column.name]
        assert one.dtype == other.dtype
        assert one.shape == other.shape
        if column.kind == "text":
            assert one.tolist() == other.tolist()
        else:
            assert np.ascontiguousarray(one).tobytes() == np.ascontiguousarray(other).tobytes()


@given(pieces())
@settings(max_examples=60, deadline=None)
def test_rows_come_back_from_journals_and_finished_files(made: tuple[Stream, list[Rows]]):
    stream, parts = made
    whole = Rows.join(parts)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        journal = Journal(folder, stream)
        for part in parts:
            journal.write(part)
        journal.close()
        assert_same(read_journal(journal.path, stream), whole, stream)
        (folder / f"{stream.name}.parquet").write_bytes(parquet_of(stream, whole, INFO))
        (folder / "bout.json").write_text('{"schema": 1, "bout": "b", "antagonist": "a", '
                                          '"protagonist": "p", "started_at_ns": 0}')  # fmt: skip
        assert_same(load_bout(folder).streams[stream.name], whole, stream)
