"""docs/study.md names every field of a protocol and every column of a table."""

from pathlib import Path

import msgspec
import pytest

from shared.study import protocol
from shared.study.rows import ParticipantRow
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


def test_every_table_of_a_protocol_is_described():
    for field in msgspec.structs.fields(protocol.Protocol):
        assert any(f"{left}{field.name}{right}" in TEXT for left, right in ("``", "[]"))


@pytest.mark.parametrize("kind", [ParticipantRow, *SESSION_TABLES.values()])
def test_every_column_of_a_table_is_described(kind):
    assert [name for name in columns_of(kind) if f"`{name}`" not in TEXT] == []
