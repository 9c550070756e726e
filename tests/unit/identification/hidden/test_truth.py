import ast
from pathlib import Path

import pytest

import shared.identification as package

ROOT = Path(package.__file__).parent
FINDING = sorted(
    path for path in ROOT.rglob("*.py") if "hidden" not in path.relative_to(ROOT).parts
)


def imported(tree):
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (each.name for each in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{each.name}" for each in node.names)


def texts_in_code(tree):
    """Return the strings that a program can use: all but docstrings and texts for the eye."""
    standing = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and id(node) not in standing:
            yield str(node.value)


@pytest.mark.parametrize("path", FINDING, ids=lambda path: str(path.relative_to(ROOT)))
def test_nothing_that_finds_knows_of_the_truth(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert not [name for name in imported(tree) if "hidden" in name.split(".")]
    assert not [text for text in texts_in_code(tree) if "truth.toml" in text]


def test_there_is_something_that_finds():
    assert len(FINDING) > 30
