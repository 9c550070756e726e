"""Killed at any moment: whoever writes a journal, and whoever deletes a participant."""

import contextlib
import itertools
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from shared.clock import ManualClock
from shared.errors import StudyError
from shared.study.journal import Journal, read_journal
from shared.study.progress import replay
from shared.study.tables import load_study
from shared.study.withdrawal import LINE, withdraw
from tests.unit.study.made import AT, play, study_in

pytestmark = [pytest.mark.chaos, pytest.mark.timeout(300)]
KILLS = 12
CLOCK = ManualClock(AT + 1000.0)

WRITER = """
import itertools, sys
from pathlib import Path
from shared.clock import SystemClock
from shared.study.events import SessionBegan, StepBegan, StepDone
from shared.study.journal import Journal

with Journal(Path(sys.argv[1]), SystemClock()) as journal:
    def write(what, step=""):
        print(journal.write(what, step).number, flush=True)

    if not journal.events:
        write(SessionBegan(participant="sub-01", session=1, order=("A",), study="s", protocol="p",
                           config="c", commit="", version="1"))
    for step in itertools.count(len(journal.events)):
        write(StepBegan(), f"step-{step}")
        write(StepDone(), f"step-{step}")
"""
"""Says the number of each event after it counts."""

WITHDRAWER = """
import os, sys
from pathlib import Path
from shared.clock import SystemClock
from shared.study.withdrawal import withdraw

left = int(sys.argv[2])
def count(event, arguments):
    global left
    if event in ("open", "os.rename", "os.remove", "os.rmdir", "os.mkdir", "os.truncate"):
        left -= 1
        if left < 0:
            os._exit(9)
sys.addaudithook(count)
withdraw(Path(sys.argv[1]), "sub-02", SystemClock())
"""
"""Dies before its n-th touch of a file."""


def child(code: str, *words: object) -> "subprocess.Popen[bytes]":
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, words)], stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, cwd=Path(__file__).parents[3],
    )  # fmt: skip


def test_a_writer_killed_at_random_moments_loses_and_doubles_no_event(tmp_path):
    random = np.random.default_rng(5)
    said = 0
    for _ in range(KILLS):
        writer = child(WRITER, tmp_path)
        assert writer.stdout is not None
        first = int(writer.stdout.readline())
        assert first > said
        time.sleep(float(random.uniform(0.0, 0.1)))  # the moment of the kill
        writer.kill()
        heard = [first, *map(int, writer.stdout.read().split(b"\n")[:-1])]
        writer.wait()
        writer.stdout.close()
        said = heard[-1]
        events = read_journal(tmp_path)
        assert [event.number for event in events] == list(range(1, len(events) + 1))
        # What was said to count is there; at most the one being written may be there besides.
        assert said <= len(events) <= said + 1
        assert len(replay(events).done) == sum(event.kind == "step_done" for event in events)
    with Journal(tmp_path, ManualClock(time.time_ns() / 1e9 + 1.0)) as journal:
        assert len(journal.events) > KILLS


def test_a_withdrawal_killed_at_any_touch_of_a_file_is_finished_by_the_next_one(tmp_path):
    study = study_in(tmp_path / "original", people=3)
    play(study, "sub-01")
    play(study, "sub-02")
    kept = (study.session_folder("sub-01") / "games.tsv").read_bytes()
    folder = tmp_path / "study"
    deaths = 0
    for touch in itertools.count():
        shutil.copytree(study.folder, folder)
        killed = child(WITHDRAWER, folder, touch)
        killed.communicate()
        if killed.returncode == 0:
            break
        assert killed.returncode == 9
        deaths += 1
        with contextlib.suppress(StudyError):  # all was done already but to sync a folder
            withdraw(folder, "sub-02", CLOCK)
        assert [path for path in folder.rglob("*") if "sub-02" in str(path)] == []
        files = [path for path in folder.rglob("*") if path.is_file()]
        assert [path for path in files if b"sub-02" in path.read_bytes()] == []
        assert (folder / "CHANGES").read_text().count(LINE) in (1, 2)
        assert load_study(folder).participants["participant"] == ["sub-01"]
        assert (folder / "sub-01" / "ses-01" / "games.tsv").read_bytes() == kept
        shutil.rmtree(folder)
    assert deaths > 20
