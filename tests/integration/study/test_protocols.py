"""The paper's two studies as they ship, with short games, through every process."""

import re
from pathlib import Path

import pytest

from shared.study.progress import replay
from shared.study.protocol_file import shipped_protocol
from shared.study.recorded import GAMES, QUESTIONNAIRE, RANKINGS
from shared.study.rows import GameRow, QuestionnaireRow, RankingRow
from shared.study.tables import load_study
from shared.study.tsv import read_table
from shared.telemetry.archive import archived_bouts
from tests.integration.study.running import People, events_of, make, running

pytestmark = [pytest.mark.zenoh, pytest.mark.slow, pytest.mark.timeout(900)]


def shortened(name: str) -> str:
    """Return a shipped protocol whose times are all short."""
    text = shipped_protocol(name).read_text("utf-8")
    text = re.sub(r"^seconds = .*$", "seconds = 1.0", text, flags=re.MULTILINE)
    return re.sub(r"^rest = .*$", "rest = 0.2", text, flags=re.MULTILINE)


@pytest.mark.parametrize(
    ("name", "sections", "games", "policies"), [("study-one", 4, 5, 4), ("study-two", 2, 10, 2)]
)
def test_a_study_of_the_paper_is_walked_in_one_go(
    tmp_path: Path, name: str, sections: int, games: int, policies: int
):
    study = make(tmp_path / "study", shortened(name))
    folder = study.session_folder("sub-02")
    people = People(folder)
    with running(study, "sub-02") as run:
        people.until(
            lambda: replay(events_of(study, "sub-02")).state == "ended", run, 600.0
        )  # fmt: skip
        code, said = run.finish()
    people.close()
    assert code == 0, said

    rows = [row for row in read_table(folder / GAMES, GameRow) if row.outcome == "finished"]
    counted = [(row.section, row.game) for row in rows if row.is_recorded]
    expected = [(s, g) for s in range(1, sections + 1) for g in range(1, games + 1)]
    assert counted == expected
    assert [row.game for row in rows if not row.is_recorded] == [1, 2]
    by_label = {row.condition: row.policy for row in rows if row.is_recorded}
    assert list(by_label) == list(study.labels_of("sub-02"))
    assert len(set(by_label.values())) == policies
    assert len(archived_bouts(folder)) == sections * games

    protocol = study.protocol
    answered = {
        (row.step, row.item) for row in read_table(folder / QUESTIONNAIRE, QuestionnaireRow)
    }
    for step in study.steps_of("sub-02"):
        if step.kind == "questionnaire":
            items = protocol.instrument_named(step.instrument).item
            assert {(step.id, item.id) for item in items} <= answered
    ranked = read_table(folder / RANKINGS, RankingRow)
    asked = [step for step in study.steps_of("sub-02") if step.kind == "ranking"]
    assert len({(row.after, row.instrument) for row in ranked}) == len(asked)
    tables = load_study(study.folder, unblind=True)
    assert set(tables.games["condition"]) - {""} == {each.name for each in protocol.condition}
