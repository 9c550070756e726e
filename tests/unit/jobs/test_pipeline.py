"""The jobs after training are done once, in order, and timed."""

import sys
import types
from collections.abc import Sequence
from pathlib import Path

import pytest

from services.jobs.train.pipeline import Pipeline, read, run_jobs, write

JOBS = (("first", "pipeline_first"), ("second", "pipeline_second"))


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Both jobs in place; the second fails when it is called first."""
    called: list[str] = []
    for name in ("first", "second"):
        module = types.ModuleType(f"pipeline_{name}")

        def main(_: Sequence[str], name: str = name) -> int:
            called.append(name)
            return 130 if name == "second" and called.count(name) == 1 else 0

        module.__dict__["main"] = main
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return called


def test_what_is_done_is_not_done_again(tmp_path: Path, calls: list[str]) -> None:
    assert run_jobs(tmp_path, 7, JOBS, report_seconds=3.0) == 130
    stages = read(tmp_path).stages
    assert [(s.name, s.done) for s in stages] == [
        ("report", True), ("first", True), ("second", False),
    ]  # fmt: skip
    assert stages[0].seconds == 3.0
    assert run_jobs(tmp_path, 7, JOBS) == 0
    assert run_jobs(tmp_path, 7, JOBS) == 0
    assert calls == ["first", "second", "second"]
    assert all(stage.done and stage.seconds >= 0.0 for stage in read(tmp_path).stages)


def test_more_training_makes_everything_after_it_due_again(
    tmp_path: Path, calls: list[str]
) -> None:
    run_jobs(tmp_path, 7, JOBS)
    run_jobs(tmp_path, 8, JOBS)
    assert calls == ["first", "second", "first", "second"]
    assert read(tmp_path).position == 8


def test_a_damaged_file_is_no_progress(tmp_path: Path) -> None:
    write(tmp_path, Pipeline(position=3))
    (tmp_path / "pipeline.json").write_bytes(b"{")
    assert read(tmp_path) == Pipeline()
