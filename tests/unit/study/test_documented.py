"""docs/study.md names every field of a protocol and every column of a table."""

import re
from pathlib import Path
from typing import get_args

import msgspec
import pytest

from shared.study import protocol
from shared.study.progress import State
from shared.study.rows import NoteRow, ParticipantRow
from shared.study.tables import SESSION_TABLES
from shared.study.tsv import columns_of

TEXT = (Path(__file__).parents[3] / "docs" / "study.md").read_text(encoding="utf-8")
TABLES = [
    each for each in vars(protocol).values()
    if isinstance(each, type) and issubclass(each, msgspec.Struct) and each is not protocol.Protocol
]  # fmt: skip


@pytest.mark.parametrize("kind", TABLES, ids=lambda kind: kind.__name__)
def test_every_field_of_a_protocol_is_described(kind):
    assert [name for name in columns_of(kind) if f"`{name}`" not in TEXT] == []


def test_the_states_of_a_session_are_described_and_no_others():
    written = [state for state in get_args(State) if state != "new"]
    assert f"`state` ({', '.join(f'`{state}`' for state in written)})" in TEXT


def test_every_table_of_a_protocol_is_described():
    for field in msgspec.structs.fields(protocol.Protocol):
        assert any(f"{left}{field.name}{right}" in TEXT for left, right in ("``", "[]"))


@pytest.mark.parametrize("kind", [ParticipantRow, NoteRow, *SESSION_TABLES.values()])
def test_every_column_of_a_table_is_described(kind):
    assert [name for name in columns_of(kind) if f"`{name}`" not in TEXT] == []


@pytest.mark.parametrize("kind", [ParticipantRow, NoteRow, *SESSION_TABLES.values()])
def test_what_is_promised_in_every_table_is_in_it(kind):
    promised = TEXT.partition("In every table: ")[2].partition("Where it applies")[0]
    names = re.findall(r"`([a-z_]+)`", promised)
    assert len(names) == 6
    assert set(names) <= set(columns_of(kind))
