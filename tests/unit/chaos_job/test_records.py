"""What is kept, and what is left to do of it."""

from pathlib import Path

import msgspec
import pytest

from services.jobs.chaos.books import Toll
from services.jobs.chaos.campaign import Plan
from services.jobs.chaos.records import INJECTIONS, Injection, JobEnd, Records
from services.jobs.chaos.sites import FAULTS, KINDS, ROBOT
from services.jobs.chaos.table import BEGIN, END, markdown, rows_of, summary, write_block
from shared.errors import ConfigError

KILLS = [FAULTS["kill-league"], FAULTS["kill-actor"]]


def injection(fault: str, full: float | None = 1.0, lost: int = 0) -> Injection:
    return Injection(
        fault=fault, job="training-0-x", victim="it", at=1.0, lasted=0.0, back=0.5, full=full,
        base=100.0, toll=Toll(lost=lost),
    )  # fmt: skip


def test_what_was_kept_is_read_back_and_not_planned_again(tmp_path: Path):
    records = Records(tmp_path)
    records.add(injection("kill-league"))
    records = Records(tmp_path)
    assert records.injections == [injection("kill-league")]
    plan = Plan(KILLS, 2, records, seed=1)
    left = [fault.name for _ in range(len(plan)) if (fault := plan.next(1e9)) is not None]
    assert sorted(left) == ["kill-actor", "kill-actor", "kill-league"]


def test_the_same_seed_plans_the_same_order(tmp_path: Path):
    plans = [Plan(list(FAULTS.values()), 3, Records(tmp_path), seed=5) for _ in range(2)]
    orders = [[plan.next(1e9) for _ in range(len(plan))] for plan in plans]
    assert orders[0] == orders[1]


def test_a_fault_that_lasts_longer_than_the_run_waits_for_another(tmp_path: Path):
    plan = Plan([FAULTS["stop"]], 1, Records(tmp_path), seed=1)
    assert plan.next(20.0) is None
    assert plan.next(60.0) is FAULTS["stop"]


def test_a_job_without_an_end_is_taken_up_again(tmp_path: Path):
    records = Records(tmp_path)
    assert records.unfinished("training") == ""
    records.add(injection("kill-league"))
    assert records.unfinished("training") == "training-0-x"
    assert records.unfinished("robot") == ""
    records.end(JobEnd(job="training-0-x", seconds=1.0, exit_code=0, finished=True))
    assert records.unfinished("training") == ""


def test_a_damaged_line_is_named(tmp_path: Path):
    (tmp_path / INJECTIONS).write_text("{}\n")
    with pytest.raises(ConfigError, match="line 1 is damaged"):
        Records(tmp_path)


def test_a_row_adds_up_its_injections():
    kept = [injection("kill-league", full) for full in (1.0, 2.0, 9.0)]
    kept += [injection("kill-league", None, lost=2)]
    (row,) = rows_of(KINDS, kept, ROBOT)
    assert (row.count, row.lost, row.never, row.median, row.worst) == (4, 2, 1, 2.0, 9.0)
    assert not row.is_harmless


def test_a_summary_counts_runs_and_what_was_compared():
    kept = [
        msgspec.structs.replace(
            injection("kill-league"), names=names, told={"x": 2}, refused={"x": 1}
        )
        for names in (10, 25)
    ]
    said = summary(kept, [JobEnd(job="training-0-x", seconds=1.0, exit_code=0, finished=True)])
    assert said.startswith("2 faults in 1 runs; 1 of the 1 runs that were watched to their end")
    assert "25 acknowledged rollouts" in said
    assert "4 lies and damaged files were offered, 2 of them refused" in said


def test_a_table_goes_between_its_marks_and_nowhere_else(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text(f"above\n{BEGIN}\nold\n{END}\nbelow\n")
    rows = rows_of(KINDS, [injection("kill-actor")], ROBOT)
    write_block(page, markdown(rows, "Said.", "Here."))
    text = page.read_text()
    assert text.startswith(f"above\n{BEGIN}\nSaid.")
    assert text.endswith(f"Here.\n{END}\nbelow\n")
    assert "| `kill-actor` | kill -9 | one of two actors | 1 | 0 |" in text
    assert "old" not in text


def test_a_page_without_marks_is_refused(tmp_path: Path):
    page = tmp_path / "page.md"
    page.write_text("nothing")
    with pytest.raises(ConfigError, match="lacks the marks"):
        write_block(page, "text")
