"""The paper's two studies as they ship, with short games: all their people, one session after the
other, through every process and the network bus; the first one's by the pages in a browser."""

import contextlib
import re
import time
from collections import Counter
from pathlib import Path

import msgspec
import pytest

from services.jobs.study.analyse import main as analyse
from services.jobs.study.hosting import read_place
from shared.study.allocation import participant_name
from shared.study.analysis.results import RESULTS, Results
from shared.study.folder import Study
from shared.study.progress import replay
from shared.study.protocol_file import shipped_protocol
from shared.study.recorded import GAMES, QUESTIONNAIRE, RANKINGS
from shared.study.rows import GameRow, QuestionnaireRow, RankingRow
from shared.study.tables import load_study
from shared.study.tsv import read_table
from shared.telemetry.archive import archived_bouts
from tests.integration.page.browsing import find_chromium
from tests.integration.study.by_pages import go_on
from tests.integration.study.running import People, Run, events_of, make, running
from tests.integration.study_pages.rig import chromium

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.timeout(5400),
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]
SESSION_SECONDS = 600.0


def shortened(name: str) -> str:
    """Return a shipped protocol whose times are all short."""
    text = shipped_protocol(name).read_text("utf-8")
    text = re.sub(r"^seconds = .*$", "seconds = 1.0", text, flags=re.MULTILINE)
    return re.sub(r"^rest = .*$", "rest = 0.2", text, flags=re.MULTILINE)


def by_sockets(study: Study, name: str, run: Run) -> None:
    with contextlib.closing(People(study.session_folder(name))) as people:
        people.until(lambda: has_ended(study, name), run, SESSION_SECONDS)


def by_pages(study: Study, name: str, run: Run) -> None:
    while (place := read_place(study.session_folder(name))) is None:
        time.sleep(0.05)
        assert run.process.poll() is None, run.said
    with chromium() as browser:
        pages = (browser.new_page(), browser.new_page())
        pages[0].goto(place.researcher)
        pages[1].goto(place.participant)
        go_on(run, pages, lambda: has_ended(study, name), SESSION_SECONDS)
        pages[1].wait_for_function("study.view().screen === 'thanks'", timeout=4000)


def has_ended(study: Study, name: str) -> bool:
    return replay(events_of(study, name)).state == "ended"


@pytest.mark.parametrize(
    ("name", "people", "sections", "games"), [("study-one", 16, 4, 5), ("study-two", 10, 2, 10)]
)
def test_a_study_of_the_paper_is_played_by_all_its_people_and_analysed(
    tmp_path: Path, name: str, people: int, sections: int, games: int
):
    study = make(tmp_path / "study", shortened(name), people)
    for number in range(1, people + 1):
        who = participant_name(number)
        with running(study, who) as run:
            (by_pages if number == 1 else by_sockets)(study, who, run)
            code, said = run.finish()
        assert code == 0, said
        check_session(study, who, sections, games)

    rows = load_study(study.folder, unblind=True).games
    counted = [
        (who, condition)
        for who, condition, is_recorded, outcome in zip(
            rows["participant"], rows["condition"], rows["is_recorded"], rows["outcome"],
            strict=True,
        )
        if is_recorded and outcome == "finished"
    ]  # fmt: skip
    assert Counter(who for who, _ in counted) == {
        participant_name(number): sections * games for number in range(1, people + 1)
    }
    conditions = Counter(condition for _, condition in counted)
    assert set(conditions) == {each.name for each in study.protocol.condition}
    assert len(set(conditions.values())) == 1  # balanced
    assert analyse([str(study.folder), "--unblind"]) == 0
    results = msgspec.json.decode((study.folder / "analysis" / RESULTS).read_bytes(), type=Results)
    assert results.people == people


def check_session(study: Study, who: str, sections: int, games: int) -> None:
    """Everything of the protocol is there once, in order, as the orders have it."""
    folder = study.session_folder(who)
    rows = [row for row in read_table(folder / GAMES, GameRow) if row.outcome == "finished"]
    counted = [(row.section, row.game) for row in rows if row.is_recorded]
    expected = [(s, g) for s in range(1, sections + 1) for g in range(1, games + 1)]
    assert counted == expected
    assert [row.game for row in rows if not row.is_recorded] == [1, 2]
    by_label = {row.condition: row.policy for row in rows if row.is_recorded}
    assert list(by_label) == list(study.labels_of(who))
    assert len(set(by_label.values())) == len(study.protocol.condition)
    assert len(archived_bouts(folder)) == sections * games

    steps = study.steps_of(who)
    answered = {
        (row.step, row.item) for row in read_table(folder / QUESTIONNAIRE, QuestionnaireRow)
    }
    for step in steps:
        if step.kind == "questionnaire":
            items = study.protocol.instrument_named(step.instrument).item
            assert {(step.id, item.id) for item in items} <= answered
    ranked = read_table(folder / RANKINGS, RankingRow)
    asked = [step for step in steps if step.kind == "ranking"]
    assert len({(row.after, row.instrument) for row in ranked}) == len(asked)
