"""A whole session by two pages in a real browser: the command, every process, the real bus.

Halfway the command is killed, with all its processes; the pages stay open and go on.
"""

import time
from pathlib import Path

import pytest

from services.jobs.study.hosting import read_place
from shared.study.progress import replay
from shared.study.recorded import GAMES
from shared.study.rows import GameRow
from shared.study.tsv import read_table
from tests.integration.page.browsing import find_chromium
from tests.integration.study.by_pages import go_on
from tests.integration.study.running import SHORT, events_of, make, running
from tests.integration.study_pages.rig import chromium

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.timeout(600),
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]


def test_a_session_is_led_and_taken_part_in_by_pages_that_outlive_a_killed_runner(tmp_path: Path):
    study = make(tmp_path / "study", SHORT)
    folder = study.session_folder("sub-01")
    with chromium() as browser:
        pages = (browser.new_page(), browser.new_page())
        with running(study, "sub-01") as run:
            while (place := read_place(folder)) is None:
                time.sleep(0.05)
                assert run.process.poll() is None, run.said
            pages[0].goto(place.researcher)
            pages[1].goto(place.participant)
            go_on(run, pages, lambda: "s1-q-mood" in replay(events_of(study)).done)
            run.kill()
        with running(
            study, "sub-01", "--port", place.researcher.split(":")[2].split("/")[0]
        ) as run:
            go_on(run, pages, lambda: replay(events_of(study)).state == "ended")
            pages[1].wait_for_function("study.view().screen === 'thanks'", timeout=4000)
            code, said = run.finish()
    assert code == 0, said
    rows = [row for row in read_table(folder / GAMES, GameRow) if row.outcome == "finished"]
    assert len(rows) == 5
    progress = replay(events_of(study))
    assert progress.answers["s1-q-mood"].answers["fun"].value == 4
    assert progress.rankings["s2-r-comparison"].ranks == {"difficulty": {1: 1, 2: 2}}
