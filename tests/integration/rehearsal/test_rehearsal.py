"""Sessions of simulated people through the real services, and the study that is made of them."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from services.jobs.study import simulate
from services.jobs.study.rehearsal_plan import make_plan, read_plan, write_plan
from services.jobs.study.rehearsal_session import Rehearsal
from shared.clock import SystemClock
from shared.errors import ConfigError
from shared.runtime.build import SOURCE_ROOT
from shared.study.drawing import draw_orders
from shared.study.folder import Study, make_study, open_study
from shared.study.journal import read_journal
from shared.study.people.population import Population
from shared.study.progress import replay
from shared.study.recorded import write_participants
from shared.study.tables import load_study

PROTOCOL = """
schema = 1
name = "tiny"
title = "A tiny study"
people = 2
[consent]
text = "Play."
statements = ["I play."]
[order]
kind = "{order}"
[[baseline]]
name = "walking"
title = "Walk"
seconds = 3.0
{more}
[game]
seconds = 1.5
[[condition]]
name = "still"
player = "scripted:static"
{condition}
[[section]]
games = {games}
rest = 1.0
instruments = ["asked"]
{section}
[[instrument]]
name = "asked"
title = "Asked"
[[instrument.item]]
id = "PU1"
construct = "PU"
text = "It is of use."
[end]
text = "Thank you."
"""
ONE = PROTOCOL.format(order="fixed", more="", condition="", games=2, section="")
TWO = PROTOCOL.format(
    order="random",
    more="[explore]\nseconds = 4.0\n[warm_up]\ngames = 1\nspeed = 0.5\nplayer = 'scripted:static'",
    condition='[[condition]]\nname = "guard"\nplayer = "scripted:guard"',
    games=3,
    section='[[section]]\ngames = 3\nrest = 1.0\ninstruments = ["asked"]',
)


def study_of(folder: Path, text: str, people: int) -> Study:
    make_study(folder, text.encode(), "tiny", "test", SystemClock())
    return draw_orders(folder, people, 1, SystemClock())


def rehearsed(folder: Path, number: int = 1) -> Rehearsal:
    plan, data = read_plan(folder)
    rehearsal = Rehearsal(open_study(folder), number, plan, data)
    try:
        rehearsal.run()
    finally:
        rehearsal.close()
    return rehearsal


def test_a_simulated_person_walks_a_whole_session_through_the_real_services(tmp_path: Path):
    study = study_of(tmp_path / "study", ONE, 1)
    write_plan(study.folder, make_plan(study.protocol, None, (), 1, is_archived=True))
    rehearsal = rehearsed(study.folder)
    progress = replay(read_journal(study.session_folder("sub-01")))
    assert progress.state == "ended"
    write_participants(study)
    tables = load_study(study.folder, unblind=True)
    assert list(tables.games["outcome"]) == ["finished", "finished"]
    assert list(tables.games["steps"]) == [150, 150]
    assert set(tables.games["condition"]) == {"still"}
    assert len(tables.questionnaire["item"]) == 1
    assert tables.heart_rate["bpm"].min() > 40.0
    assert rehearsal.desk.armed == 1
    for bout in tables.games["bout"]:
        assert (study.session_folder("sub-01") / "bouts" / bout).is_dir()
    measured = progress.baselines["baseline-walking"]
    assert measured.beats >= 2


def test_a_study_begun_with_other_settings_is_not_taken_up(tmp_path: Path):
    study = study_of(tmp_path / "study", ONE, 1)
    write_plan(study.folder, make_plan(study.protocol, None, (), 1, is_archived=True))
    other = make_plan(study.protocol, None, ("people.specific=0.0",), 1, is_archived=True)
    assert other.people == Population(specific=0.0)
    with pytest.raises(ConfigError, match="begun with other settings"):
        write_plan(study.folder, other)
    with pytest.raises(ConfigError, match=r"people: .*learnin"):
        make_plan(study.protocol, None, ("people.learnin=1",), 1, is_archived=True)
    with pytest.raises(ConfigError, match=r"page\.port=1"):
        make_plan(study.protocol, None, ("page.port=1",), 1, is_archived=True)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_the_same_seed_gives_the_same_games(tmp_path: Path):
    found = []
    for name in ("one", "two"):
        study = study_of(tmp_path / name, TWO, 1)
        write_plan(study.folder, make_plan(study.protocol, None, (), 5, is_archived=False))
        rehearsed(study.folder)
        write_participants(study)
        games = load_study(study.folder).games
        found.append((list(games["score"]), list(games["t_ns"])))
    assert found[0] == found[1]


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_rehearsal_that_was_killed_is_taken_up_and_analysed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    protocol, out = tmp_path / "tiny.toml", tmp_path / "study"
    protocol.write_text(TWO)
    words = [str(protocol), "--out", str(out), "--people", "3", "--seed", "2", "--no-archive"]
    command = [sys.executable, "-c", "import sys; from services.jobs.study.simulate import main; "
               "sys.exit(main(sys.argv[1:]))", *words]  # fmt: skip
    path = os.pathsep.join(filter(None, (str(SOURCE_ROOT), os.environ.get("PYTHONPATH"))))
    process = subprocess.Popen(
        command, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.DEVNULL
    )
    try:
        over = wait_for_a_session(out, process)
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    kept = (out / over / "ses-01" / "journal.jsonl").read_bytes()
    assert simulate.main([*words, "--json"]) == 0
    assert (out / over / "ses-01" / "journal.jsonl").read_bytes() == kept
    said = json.loads(capsys.readouterr().out)
    assert said["people"] == 3
    assert "simulated people are not people" in said["says"][0]
    states = load_study(out).participants["state"]
    assert list(states) == ["ended"] * 3
    page = (out / "analysis" / "report.html").read_text()
    assert "simulated people are not people" in page


def wait_for_a_session(out: Path, process: subprocess.Popen[bytes]) -> str:
    """Return the participant whose session was over first."""
    until = time.monotonic() + 400.0
    while time.monotonic() < until and process.poll() is None:
        for journal in sorted(out.glob("sub-*/ses-01/journal.jsonl")):
            if b"session_ended" in journal.read_bytes():
                return journal.parents[1].name
        time.sleep(0.2)
    raise AssertionError("no session came to its end")
