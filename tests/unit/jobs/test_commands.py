"""What was typed is what a report says."""

from pathlib import Path

from services.jobs import commands
from services.jobs.report.command import write_report
from services.jobs.train.arguments import folder_of, parse
from tests.unit.jobs.ledgers import finished_run, stopped_run
from tests.unit.jobs.two_phases import played_run


def test_every_command_is_kept_in_its_order_and_quoted(tmp_path: Path) -> None:
    assert commands.made_by(tmp_path) == ""
    commands.note(tmp_path, ["train", "--out", "a b"])
    commands.note(tmp_path, ["train", "--resume"])
    commands.note(tmp_path, ["train", "--resume"])
    assert commands.made_by(tmp_path) == "riposte train --out 'a b' && riposte train --resume"


def test_the_report_says_what_was_typed_also_of_what_came_after_an_earlier_report(
    tmp_path: Path,
) -> None:
    folder = finished_run(tmp_path)
    commands.note(folder, ["train", "--phase", "one"])
    assert write_report(folder, pictures=False).origin.command == "riposte train --phase one"
    commands.note(folder, ["train", "--phase", "two"])
    typed = "riposte train --phase one && riposte train --phase two"
    assert write_report(folder, pictures=False).origin.command == typed
    assert "riposte train --phase one &amp;&amp; riposte" in (folder / "report.html").read_text()
    (folder / commands.FILE).unlink()
    assert write_report(folder, pictures=False).origin.command == typed


def test_a_renamed_run_keeps_its_name(tmp_path: Path) -> None:
    stopped_run(tmp_path / "before")
    (tmp_path / "before").rename(tmp_path / "after")
    found = parse(["--resume", "--out", str(tmp_path / "after")])
    assert folder_of(found) == (tmp_path / "after", "quick")
    assert played_run(tmp_path / "both").run == "both"
    fresh = parse(["--out", str(tmp_path / "new run")])
    assert folder_of(fresh) == (tmp_path / "new run", "new-run")
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / "league.sqlite").touch()
    found = parse(["--resume", "--out", str(tmp_path / "empty")])
    assert folder_of(found) == (tmp_path / "empty", "empty")
