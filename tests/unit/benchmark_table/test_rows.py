"""The table of results is read again as it was written."""

from pathlib import Path

import pytest

from benchmarks.picture import contests_of, draw, goals_of
from benchmarks.rows import Figure, Row, newest, rows_of
from services.jobs import bench
from services.jobs.bench import Check, Measurement
from shared.errors import ConfigError
from shared.runtime.build import SOURCE_ROOT

KEPT = SOURCE_ROOT / "benchmarks" / bench.RESULTS


def written(path: Path, goal: Check, checks: tuple[Check, ...] = (), runs: tuple = ()) -> Row:
    found = Measurement(
        value=67_031.0, unit="samples/s", limit=39_624.0, ratio=goal, runs=runs, checks=checks
    )
    bench.add_row(path, bench.report_of("peers", lambda: found, smoke=False), "riposte bench peers")
    return rows_of(path)[-1]


def test_a_row_says_what_the_report_said(tmp_path: Path):
    goal = Check(name="ours / theirs, of a | b", value=1.73, goal=1.5)
    peers = (
        Check(name="ours / RLlib", value=6.98),
        Check(name="samples/s of RLlib", value=9608.0),
        Check(name="memory of Stable-Baselines3", value=418.0, unit="MiB", low=400.0, high=1430.0),
    )
    row = written(tmp_path / "R.md", goal, peers, ({"ratio": 1.9}, {"ratio": 1.6}, {"ratio": 1.7}))
    assert row.main == Figure("ours / theirs, of a / b", 1.73, 1.6, 1.9)
    assert (row.benchmark, row.goal, row.is_at_least, row.measured) == ("peers", 1.5, True, 67_031)
    assert row.also == (
        Figure("ours / RLlib", 6.98),
        Figure("samples/s of RLlib", 9608.0),
        Figure("memory of Stable-Baselines3", 418.0, 400.0, 1430.0, "MiB"),
    )
    assert row.over(row.main.value) >= 1.0


def test_an_interval_and_a_unit_are_read(tmp_path: Path):
    goal = Check(
        name="first update",
        value=4790.0,
        unit="ms",
        goal=15.0,
        goal_is="at most",
        low=-1.0,
        high=5e3,
    )
    row = written(tmp_path / "R.md", goal)
    assert row.main == Figure("first update", 4790.0, -1.0, 5000.0)
    assert row.over(row.main.value) < 1.0
    assert row.over(30.0) == pytest.approx(0.5)
    assert row.over(7.5) == pytest.approx(2.0)


def test_what_was_withdrawn_is_left_out_and_the_newest_row_counts(tmp_path: Path):
    table = tmp_path / "R.md"
    for value in (1.0, 2.0):
        written(table, Check(name="ours / theirs", value=value, goal=1.5))
    text = table.read_text(encoding="utf-8")
    table.write_text(text + text.splitlines()[-1].replace("**2**", "withdrawn, why: **2**") + "\n")
    rows = rows_of(table)
    assert [row.main.value for row in rows] == [1.0, 2.0]
    assert newest(rows)["peers"].main.value == 2.0
    (goal,) = goals_of(rows)
    assert (goal.value, goal.before) == (pytest.approx(2 / 1.5), [pytest.approx(1 / 1.5)])


def test_a_row_that_cannot_be_read_is_named(tmp_path: Path):
    table = tmp_path / "R.md"
    written(table, Check(name="ours / theirs", value=1.0, goal=1.5))
    whole = table.read_text(encoding="utf-8")
    table.write_text(whole.replace("goal at least", "wish"))
    with pytest.raises(ConfigError, match=r"line 10: .* is no figure with a goal"):
        rows_of(table)
    table.write_text(whole.replace(" | `riposte bench peers`", ""))
    with pytest.raises(ConfigError, match="line 10: 7 cells, expected 8"):
        rows_of(table)


def test_the_kept_table_is_read_and_drawn(tmp_path: Path):
    rows = rows_of(KEPT)
    assert len(rows) > 30
    draw(KEPT, tmp_path / "deep" / "picture.png")
    assert (tmp_path / "deep" / "picture.png").read_bytes()[:4] == b"\x89PNG"
    contests = {contest.title: contest for contest in contests_of(newest(rows))}
    assert contests.keys() == {"Training", "To the same skill", "Bus"}
    labels = [bar.label for bar in contests["Training"].bars]
    assert {"Riposte", "RLlib", "Sample Factory", "Stable-Baselines3"} <= set(labels)
    values = [bar.value for bar in contests["Bus"].bars]
    assert values == sorted(values)
    assert all(bar.is_ours == bar.label.startswith("Riposte") for bar in contests["Bus"].bars)
