"""The generator of the topic table."""

from pathlib import Path

import pytest

from shared.messages.table import BEGIN, END, main, table
from shared.messages.topics import SERVICES, TOPICS


def test_every_topic_and_service_has_a_row() -> None:
    rows = table().splitlines()[2:]
    assert len(rows) == len(TOPICS) + len(SERVICES)
    for entry in (*TOPICS, *SERVICES):
        assert sum(f"| `{entry.key}` |" in row for row in rows) == 1
    assert len({row.count("|") for row in rows}) == 1


def test_writing_renews_only_what_is_between_the_markers(tmp_path: Path) -> None:
    page = tmp_path / "architecture.md"
    page.write_text(f"before\n{BEGIN}\nold\n{END}\nafter\n")
    assert main(["--check", str(page)]) == 1
    assert main(["--write", str(page)]) == 0
    assert main(["--check", str(page)]) == 0
    assert page.read_text() == f"before\n{BEGIN}\n{table()}\n{END}\nafter\n"


@pytest.mark.parametrize("text", ["", f"{END}\n{BEGIN}\n", f"{BEGIN}\n{BEGIN}\n{END}\n"])
def test_a_page_without_its_markers_is_left_alone_with_one_line(
    text: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "architecture.md"
    page.write_text(text)
    assert main(["--write", str(page)]) == 2
    assert page.read_text() == text
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert BEGIN in error


def test_a_missing_page_is_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--check", str(tmp_path / "none.md")]) == 2
    assert "No such file" in capsys.readouterr().err
