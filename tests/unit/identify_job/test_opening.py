"""What is printed before the work begins."""

from pathlib import Path

from services.jobs.identify.command import opening
from shared.identification.dataset.reading import read_dataset
from tests.unit.identification.dataset.folders import MANIFEST, command, motion, table, written


def test_the_first_line_says_what_there_is(tmp_path: Path) -> None:
    said = opening(read_dataset(written(tmp_path)), Path("out"))
    assert said.startswith("2 joints, 2 recordings to fit and 1 held out, 12 s in all; ")
    assert said.endswith(" s in all; writes to out\ncaveats: no_repeat")


def test_a_repeat_is_neither_fitted_to_nor_held_out(tmp_path: Path) -> None:
    again = MANIFEST.replace('name = "two"', 'name = "two"\nrepeats = "one"')
    folder = written(tmp_path, manifest=again)
    table(folder / "two" / "command.parquet", command(motion(0)))
    said = opening(read_dataset(folder), Path("out"))
    assert "1 recordings to fit and 1 held out (1 repeated), " in said


def test_signs_that_do_not_match_are_told_before_anything_is_fitted(tmp_path: Path) -> None:
    folder = written(tmp_path)
    joints = motion(1)
    sent = command(joints) | {"elbow": -joints["q_elbow"]}
    table(folder / "two" / "command.parquet", sent)
    _, caveats, told = opening(read_dataset(folder), Path("out")).splitlines()
    assert caveats == "caveats: no_repeat, other_way"
    assert told.startswith("beware: two: joint 'elbow' goes the other way than its command")
