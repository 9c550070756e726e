from pathlib import Path

import pytest

from shared.errors import ConfigError
from shared.messages.markdown import renewed
from shared.telemetry.columns import BEGIN, END, describe, main

PAGE = Path(__file__).resolve().parents[3] / "docs" / "recordings.md"


def test_the_tables_of_the_documentation_are_current() -> None:
    text = PAGE.read_text("utf-8")
    assert renewed(text, BEGIN, END, describe()) == text, "run: make docs"


def test_the_tables_are_written_between_their_markers(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# Page\n<!-- columns:begin -->\noutdated text\n<!-- columns:end -->\nend\n")
    assert main([str(page)]) == 0
    text = page.read_text()
    assert "| `antagonist_velocity` | m/s | float64[3] |" in text
    assert text.startswith("# Page\n")
    assert text.endswith("<!-- columns:end -->\nend\n")
    assert "outdated text" not in text
    assert describe() in text


def test_a_page_without_markers_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    page = tmp_path / "page.md"
    page.write_text("# Page\n")
    with pytest.raises(ConfigError, match="columns:begin"):
        renewed(page.read_text(), BEGIN, END, describe())
    assert main([str(page)]) == 2
    assert main([str(tmp_path / "none.md")]) == 2
    assert main([]) == 2
    assert "usage" in capsys.readouterr().err
