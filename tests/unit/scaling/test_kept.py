"""Runs of a measurement are kept as they end, and not made again."""

from pathlib import Path

import pytest

from benchmarks.scaling.kept import KeptRuns
from shared.errors import ConfigError, RiposteError


def never() -> dict:
    raise AssertionError("it was run again")


def test_a_stopped_measurement_goes_on_with_what_it_has(tmp_path: Path):
    path = tmp_path / "scale.jsonl"
    kept = KeptRuns(path, lambda _: None)
    assert kept.get("one", lambda: {"rate": 1.5}) == {"rate": 1.5}
    kept.get("two", lambda: {"rate": 2.5})
    path.write_bytes(path.read_bytes()[:-5])  # killed while it wrote the second

    again = KeptRuns(path, lambda _: None)
    assert (again.has("one"), again.has("two")) == (True, False)
    assert again.get("one", never) == {"rate": 1.5}
    assert again.get("two", lambda: {"rate": 3.5}) == {"rate": 3.5}
    assert KeptRuns(path, lambda _: None).get("two", never) == {"rate": 3.5}


def test_a_run_that_fails_is_left_out_and_said(tmp_path: Path):
    def fail() -> dict:
        raise RiposteError("the router died")

    said: list[str] = []
    kept = KeptRuns(tmp_path / "scale.jsonl", said.append)
    assert kept.get("one", fail) is None
    assert kept.skipped == ["one: the router died"]
    assert said == ["left out: one: the router died"]


def test_only_what_is_kept_is_used_when_asked_for(tmp_path: Path):
    kept = KeptRuns(tmp_path / "scale.jsonl", lambda _: None, only_kept=True)
    assert kept.get("one", never) is None
    assert kept.skipped == ["one: not run"]


def test_another_file_is_refused(tmp_path: Path):
    path = tmp_path / "scale.jsonl"
    path.write_text('{"at": 3}\n')
    with pytest.raises(ConfigError, match="line 1"):
        KeptRuns(path, lambda _: None)
