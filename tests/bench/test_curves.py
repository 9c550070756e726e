import json
from pathlib import Path
from typing import Any

import pytest

from benchmarks.curves import compared, main, runs_of
from shared.errors import ConfigError


def run(seed: int, gain: float) -> dict[str, Any]:
    curve = [{"samples": k * 1000, "score": gain * k + seed} for k in range(1, 101)]
    return {"seed": seed, "curve": curve, "in_target_share": 0.9 + 0.01 * seed, "score": 100 * gain}


def kept(path: Path, runs: list[dict[str, Any]]) -> Path:
    path.write_text(json.dumps({"static": {"runs": runs}}))
    return path


def test_curves_that_differ_no_more_than_seeds_do_are_the_same(tmp_path: Path, capsys: Any):
    before = kept(tmp_path / "before.json", [run(0, 10.0), run(1, 11.0), run(2, 12.0)])
    after = kept(tmp_path / "after.json", [run(2, 11.0), run(0, 11.0), run(1, 11.0)])
    figure = tmp_path / "both.png"
    assert main([str(before), str(after), "--out", str(figure)]) == 0
    assert figure.read_bytes().startswith(b"\x89PNG")
    said = capsys.readouterr().out
    # the first quarter holds k = 1 .. 25, of mean 13: 11 * 13 + 1 at gain 11 and seed 1
    assert "| score in quarter 1 of the curve | 144 [109, 179] | 144 [142, 146] | 0 [" in said


def test_a_change_that_every_seed_shows_is_found():
    before, after = ([run(seed, gain + 0.01 * seed) for seed in range(3)] for gain in (10.0, 12.0))
    lines, is_same = compared(before, after)
    assert not is_same
    assert (
        lines[-1]
        == "| score, at the end | 1,001 [999, 1,003] | 1,201 [1,199, 1,203] | 200 [200, 200] |"
    )


def test_other_seeds_and_files_without_runs_are_refused(tmp_path: Path):
    with pytest.raises(ConfigError, match=r"seeds \[0, 1\] and \[0, 2\]"):
        compared([run(0, 1.0), run(1, 1.0)], [run(0, 1.0), run(2, 1.0)])
    (tmp_path / "x.json").write_text("{}")
    with pytest.raises(ConfigError, match="has no runs"):
        runs_of(tmp_path / "x.json")
