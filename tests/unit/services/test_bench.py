import json
import os
from pathlib import Path

import pytest

from services.jobs import bench
from services.jobs.bench import Check, Measurement
from shared.errors import ConfigError


def a_report(ratio: float = 0.9) -> dict:
    def measure() -> Measurement:
        return Measurement(
            value=9.0,
            unit="steps/s",
            limit=10.0,
            ratio=Check(name="ours / theirs", value=ratio, goal=0.8),
            runs=({"ratio": ratio}, {"ratio": ratio / 2}),
            checks=(Check(name="memory", value=250.0, unit="MB", goal=200.0, goal_is="at most"),),
        )

    return bench.report_of("try", measure, smoke=False)


def test_a_goal_is_met_on_its_own_side():
    assert Check(name="x", value=0.8, goal=0.8).is_met
    assert not Check(name="x", value=0.7, goal=0.8).is_met
    assert Check(name="x", value=0.7, goal=0.8, goal_is="at most").is_met
    assert not Check(name="x", value=0.9, goal=0.8, goal_is="at most").is_met
    assert Check(name="x", value=-1.0).is_met


def test_the_object_has_the_fields_that_others_rely_on():
    report = json.loads(json.dumps(a_report()))
    wanted = {"name", "value", "unit", "limit", "ratio", "runs", "cpu_s", "wall_s", "commit"}
    assert wanted <= report.keys()
    assert (report["value"], report["limit"], report["ratio"]) == (9.0, 10.0, 0.9)
    assert report["goal"]["met"] is True
    assert report["checks"][0]["met"] is False
    assert len(report["machine"]["load_before"]) == 3


def test_a_script_that_keeps_to_one_core_ran_on_a_machine_of_all_of_them():
    cores = os.sched_getaffinity(0)

    def measure() -> Measurement:
        os.sched_setaffinity(0, {min(cores)})
        ratio = Check(name="x", value=1.0)
        return Measurement(value=1.0, unit="1", limit=1.0, ratio=ratio, runs=())

    try:
        assert bench.report_of("try", measure, smoke=False)["machine"]["cores"] == len(cores)
    finally:
        os.sched_setaffinity(0, cores)


def test_the_text_marks_what_is_met_and_what_is_missed():
    text = bench.text_of(a_report())
    met, missed = (line for line in text.splitlines() if "goal" in line)
    assert "✓" in met
    assert "at least 0.8" in met
    assert "✗" in missed
    assert "at most 200" in missed


def test_a_row_is_added_under_the_head_of_the_table(tmp_path: Path):
    path = tmp_path / "RESULTS.md"
    bench.add_row(path, a_report(), "riposte bench try")
    bench.add_row(path, a_report(), "riposte bench try")
    rows = [line for line in path.read_text(encoding="utf-8").splitlines() if line[:1] == "|"]
    assert len(rows) == 4
    assert len({row.count("|") for row in rows}) == 1
    assert "**0.9** (0.45 to 0.9, n = 2)" in rows[-1]
    assert "`riposte bench try`" in rows[-1]


def test_without_a_name_every_script_is_listed_with_its_question(capsys):
    assert bench.main([]) == 0
    listed = dict(line.split(maxsplit=1) for line in capsys.readouterr().out.splitlines())
    assert {"actor", "bus", "start", "train"} <= listed.keys()
    assert "harness" not in listed


def test_an_unknown_name_is_refused_with_the_nearest():
    with pytest.raises(ConfigError, match=r"no benchmark 'acter'.*actor"):
        bench.main(["acter"])


def test_smoke_figures_are_never_kept():
    with pytest.raises(ConfigError, match="--smoke"):
        bench.main(["actor", "--smoke", "--write"])


def test_an_installation_without_the_source_says_where_to_get_it(tmp_path: Path, monkeypatch):
    monkeypatch.setattr(bench, "SOURCE_ROOT", tmp_path)
    with pytest.raises(ConfigError, match="clone the repository"):
        bench.main(["actor"])
