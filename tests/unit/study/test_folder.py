"""The folder of a study: made, given its orders, filled, read back, refused when it is wrong."""

import json
import shutil
import stat

import numpy as np
import pytest

from shared.clock import ManualClock
from shared.errors import ConfigError, StudyError
from shared.study.drawing import draw_orders
from shared.study.folder import make_study, open_study
from shared.study.protocol_file import shipped_protocol
from shared.study.recorded import refresh
from shared.study.tables import load_study
from tests.unit.study.made import AT, play, study_in

CLOCK = ManualClock(AT)


@pytest.fixture(scope="module")
def original(tmp_path_factory):
    study = study_in(tmp_path_factory.mktemp("original") / "s")
    play(study, "sub-02", is_repeated="s2-g01")
    play(study, "sub-01")
    return study


@pytest.fixture
def played(original, tmp_path):
    """A study of which two people have played, to be spoilt."""
    shutil.copytree(original.folder, tmp_path / "s")
    return open_study(tmp_path / "s")


def test_a_new_study_holds_what_it_needs(tmp_path):
    study = study_in(tmp_path / "s")
    names = {path.name for path in study.folder.iterdir()}
    assert names == {
        "dataset_description.json", "protocol.toml", "allocation.tsv", "key.toml",
        "participants.tsv", "CHANGES",
    }  # fmt: skip
    assert json.loads((study.folder / "dataset_description.json").read_text())["Name"]
    assert (study.folder / "CHANGES").read_text().splitlines() == [
        "2027-01-15 study my-study made",
        "2027-01-15 orders drawn: 4 participants are expected",
    ]


def test_only_its_owner_reads_the_key_and_no_other_file_names_a_condition(played):
    assert stat.S_IMODE((played.folder / "key.toml").stat().st_mode) == 0o600
    files = [path for path in played.folder.rglob("*") if path.is_file()]
    telling = {path.name for path in files if "first-style" in path.read_text()}
    assert telling == {"key.toml", "protocol.toml"}


def test_a_played_session_is_read_back_blinded_and_unblinded(played):
    blind, open_ = load_study(played.folder), load_study(played.folder, unblind=True)
    games = blind.games
    assert games["participant"] == ["sub-01"] * 10 + ["sub-02"] * 11
    counts = (np.array(games["outcome"]) == "finished") & games["is_recorded"]
    assert counts.sum() == 18
    assert games["outcome"].count("repeat") == 1
    assert games["attempt"].max() == 2
    assert games["score"][counts][:3].tolist() == [101.0, 102.0, 103.0]
    first = tuple(games["condition"][1:10:3])
    assert first == played.labels_of("sub-01")
    assert tuple(open_.games["condition"][1:10:3]) == played.order_of("sub-01")
    assert open_.participants["order"][0] == ",".join(played.order_of("sub-01"))
    assert blind.participants["state"] == ["ended", "ended"]
    assert blind.participants["games"].tolist() == [9, 9]
    assert blind.heart_rate["bpm"].tolist() == [81.25] * 21
    assert (blind.is_blinded, open_.is_blinded) == (True, False)


def test_answers_are_read_back_word_by_word(played):
    answers = load_study(played.folder).questionnaire
    rows = [dict(zip(answers, row, strict=True)) for row in zip(*answers.values(), strict=True)]
    mood = [row for row in rows if row["instrument"] == "mood" and row["section"] == 1]
    assert [(row["item"], row["value"], row["option"], row["text"]) for row in mood[:4]] == [
        ("fun", 2.0, "", ""),
        ("dull", 2.0, "", ""),
        ("words", 1.0, "Easy", ""),
        ("words", 3.0, "Others (please describe)", "my\town\nwords"),
    ]
    assert [row["reversed"] for row in mood[:4]] == [False, True, False, False]
    assert {row["condition"] for row in mood[:4]} == {played.labels_of("sub-01")[0]}
    assert rows[-1]["item"] == "remarks"
    assert rows[-1]["text"] == 'said "n/a"; then\t\\n'
    assert rows[-1]["condition"] == ""


def test_rankings_say_after_which_section_they_were_made(played):
    ranks = load_study(played.folder).rankings
    assert ranks["after"].tolist()[:5] == [2, 2, 3, 3, 3]
    assert ranks["section"].tolist()[:5] == [1, 2, 1, 2, 3]
    assert ranks["rank"].tolist()[:5] == [1, 2, 1, 2, 2]
    assert tuple(ranks["condition"][2:5]) == played.labels_of("sub-01")


def test_more_people_get_orders_of_the_same_seed_and_nobody_another_one(tmp_path):
    study = study_in(tmp_path / "s")
    more = draw_orders(study.folder, 9, 7, CLOCK)
    assert more.assignments[:4] == study.assignments
    assert len(more.assignments) == 9
    with pytest.raises(StudyError, match="holds other orders"):
        draw_orders(study.folder, 9, 8, CLOCK)
    assert open_study(study.folder) == more


def test_a_folder_that_holds_something_is_left_alone(tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(StudyError, match="not empty"):
        make_study(tmp_path, shipped_protocol("template").read_bytes(), "t", "1", CLOCK)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_participant_who_stands_twice_in_the_allocation_is_refused(tmp_path):
    study = study_in(tmp_path / "s")
    path = study.folder / "allocation.tsv"
    path.write_text(path.read_text() + "sub-01\tA,B,C\n")
    with pytest.raises(StudyError, match=r"allocation\.tsv:6: sub-01 stands here twice"):
        open_study(study.folder)


def test_an_order_that_lacks_a_label_is_refused(tmp_path):
    study = study_in(tmp_path / "s")
    (study.folder / "allocation.tsv").write_text("participant\torder\nsub-01\tA,B\n")
    with pytest.raises(StudyError, match=r":2: the order of sub-01 is A,B, expected each of A,B,C"):
        open_study(study.folder)


def test_a_name_of_a_person_is_no_participant(tmp_path):
    study = study_in(tmp_path / "s")
    for name in ("anna", "sub-1", "../sub-01", "sub-01/..", ""):
        with pytest.raises(StudyError, match="names of people"):
            study.session_folder(name)
    with pytest.raises(StudyError, match="it has sub-01 to sub-04"):
        study.labels_of("sub-05")


def test_a_protocol_that_was_changed_after_the_orders_were_drawn_is_noticed(tmp_path):
    study = study_in(tmp_path / "s")
    path = study.folder / "protocol.toml"
    text = path.read_text()
    path.write_text(text.replace('player = "style-3"', 'player = "scripted:heuristic"'))
    with pytest.raises(StudyError, match="conditions or players are others"):
        open_study(study.folder)
    path.write_text(text.replace("What would you change?", "What would you like to change?"))
    with pytest.raises(StudyError, match="was changed after the orders were drawn"):
        open_study(study.folder)
    again = draw_orders(study.folder, 4, 7, CLOCK)
    assert again.assignments == study.assignments


def test_without_its_key_a_study_can_be_read_but_not_unblinded(played, tmp_path):
    (played.folder / "key.toml").rename(tmp_path / "key.toml")
    assert load_study(played.folder).games["participant"]
    with pytest.raises(StudyError, match="has no key"):
        load_study(played.folder, unblind=True)


def test_a_row_in_the_wrong_folder_is_refused(played):
    path = played.session_folder("sub-01") / "games.tsv"
    path.write_text(path.read_text().replace("sub-01", "sub-02"))
    with pytest.raises(StudyError, match=r"games\.tsv:2: a row of sub-02"):
        load_study(played.folder)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("\t2000\t", "\tmany\t", r"games\.tsv:2: column 'steps' is 'many', expected a whole"),
        ("\t101.0\t", "\tnan\t", r"games\.tsv:3: column 'score' is 'nan', expected a number"),
        ("outcome", "result", r"games\.tsv:1: column 'outcome' must be there once"),
        ("\ttrue\t", "\t", r"games\.tsv:3: 21 cells, expected 22"),
    ],
)  # fmt: skip
def test_a_damaged_table_is_named_with_line_and_column(played, old, new, said):
    path = played.session_folder("sub-01") / "games.tsv"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(StudyError, match=said):
        load_study(played.folder)


def test_a_key_that_is_none_is_named_with_its_line(tmp_path):
    study = study_in(tmp_path / "s")
    path = study.folder / "key.toml"
    path.write_text(path.read_text().replace("seed = 7", 'seed = "seven"'))
    with pytest.raises(ConfigError, match=r"key\.toml:6: seed: expected `int`, got `str`"):
        open_study(study.folder)


def test_a_journal_that_was_copied_to_another_participant_is_refused(played):
    shutil.copytree(played.folder / "sub-01", played.folder / "sub-03")
    with pytest.raises(StudyError, match="is of sub-01, session 1"):
        refresh(played)
