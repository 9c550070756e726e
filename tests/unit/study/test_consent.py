"""Nothing is measured before the participant has agreed to it."""

from pathlib import Path

from shared.study.rows import HeartRateRow
from shared.study.tsv import read_table
from tests.unit.study.runner_stand import Stand


def test_no_heart_rate_is_kept_before_the_consent(tmp_path: Path):
    stand = Stand(tmp_path / "study")
    assert stand.ask("begin").is_done
    stand.tick(3.0)
    assert stand.session.step.kind == "consent"
    assert read_table(stand.session_folder / "hr.tsv", HeartRateRow) == []
    assert stand.say("consent").is_done
    stand.walk("instruction")
    stand.study.close()
    rows = read_table(stand.session_folder / "hr.tsv", HeartRateRow)
    assert {row.step for row in rows} == {"baseline-walking"}
