from pathlib import Path

import pytest

from shared.identification.catalogue import effects
from shared.identification.hidden.catalogue_page import BEGIN, END, describe, main
from shared.messages.markdown import renewed

PAGE = Path(__file__).resolve().parents[4] / "docs" / "effects.md"


def test_the_list_of_effects_is_current_and_has_all_of_them() -> None:
    text = PAGE.read_text("utf-8")
    made = describe()
    assert renewed(text, BEGIN, END, made) == text, "run: make docs"
    assert all(f"**`{each.name}`**: {each.title}." in made for each in effects())


def test_another_number_of_files_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert "usage" in capsys.readouterr().err
