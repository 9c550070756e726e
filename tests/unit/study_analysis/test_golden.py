"""Studies made to have the paper's numbers give the paper's numbers, to the printed digit."""

import csv
import dataclasses

import msgspec
import numpy as np
import pytest

from services.jobs.study.analyse import main, summary_text
from shared.errors import RiposteError
from shared.study.analysis.chapters.acceptance import acceptance_chapter
from shared.study.analysis.chapters.answers import answers_chapter
from shared.study.analysis.chapters.heart_rate import heart_rate_chapter
from shared.study.analysis.chapters.rankings import rankings_chapter
from shared.study.analysis.games import games_of
from shared.study.analysis.methods import Methods
from shared.study.analysis.page import report_page
from shared.study.analysis.results import ChapterResults, Results, analyse_folder
from shared.study.tables import load_study
from tests.unit.study.made import play, study_in
from tests.unit.study_analysis.made import Person, line_scores, write_study

TABLE_1 = {
    "PU": (0, 6.25, 25, 37.5, 31.25),
    "PEOU": (0, 18.75, 18.75, 62.5, 0),
    "ATT": (0, 6.25, 37.5, 25, 31.25),
    "ITU": (0, 18.75, 18.75, 25, 37.5),  # the paper prints 18.74 and 18.75 for three of sixteen
    "PENJ": (0, 6.25, 6.25, 31.25, 56.25),
    "DE": (0, 6.25, 12.5, 31.25, 50),
    "IE": (6.25, 6.25, 31.25, 18.75, 37.5),
}
"""Of the paper, 16 people."""
RAISED, RESTFUL = 93, 24
"""Of 320 games: peak 20 % above walking or more (29 %), at most walking (7.4 %)."""
LINES = {"baseline": (30.0, 0.5648, 383.5), "rl": (15.7, 0.3419, 349.1)}
"""Slope, r and mean score of study two, 10 people, 10 games; r to the digits that give its p."""


@pytest.fixture(scope="module")
def study_one(tmp_path_factory):
    folder = tmp_path_factory.mktemp("one") / "study"
    generator = np.random.default_rng(1)
    answers = {
        construct: np.repeat(np.arange(1, 6), np.round(np.array(shares) * 0.16).astype(int))
        for construct, shares in TABLE_1.items()
    }
    ratios = np.concatenate(
        [np.full(RAISED, 1.25), np.full(RESTFUL, 0.95), np.full(320 - RAISED - RESTFUL, 1.1)]
    )
    ratios[0] = 1.58
    ratios = ratios[generator.permutation(320)].reshape(16, 4, 5)

    def make(k, order):
        ranks = {name: 1 if name == "warm-start" else 2 + (k + j) % 3
                 for j, name in enumerate(sorted(order))}  # fmt: skip
        return Person(
            scores={name: generator.normal(300.0, 100.0, 5) for name in order},
            peaks={name: 90.0 * ratios[k, j] for j, name in enumerate(order)},
            answers={(0, construct): int(values[k]) for construct, values in answers.items()}
            | {(section, "adjectives"): ["Exciting"] if section % 2 else ["Boring", "Amusing"]
               for section in range(1, 5)},
            ranks={"enjoyment": ranks, "difficulty": ranks},
        )  # fmt: skip

    write_study(folder, "study-one", 16, make)
    tables = load_study(folder, unblind=True)
    games, generator = games_of(tables), np.random.default_rng(0)
    return {
        "acceptance": acceptance_chapter(tables, games, generator),
        "answers": answers_chapter(tables, games),
        "heart-rate": heart_rate_chapter(tables, games, generator),
        "rankings": rankings_chapter(tables, games, generator),
    }


@pytest.fixture(scope="module")
def study_two(tmp_path_factory):
    folder = tmp_path_factory.mktemp("two") / "study"
    scores = {
        name: line_scores(slope, r, mean, people=10, games=10, seed=len(name))
        for name, (slope, r, mean) in LINES.items()
    }

    def make(k, order):
        # the seventh and eighth say baseline, the last equally
        robot = "rl" if k < 7 else "baseline"
        chosen = f"Section {order.index(robot) + 1}" if k < 9 else "equally"
        points = {"baseline": (3, 4, 5, 3), "rl": (4, 4, 3, 5)}
        return Person(
            scores={name: scores[name][k] for name in order},
            answers={(0, "Q4"): [chosen], (0, "Q4-why"): "=cmd|it is <b>defensive</b>"}
            | {(section, "PEOU"): points[name][k % 4]
               for section, name in enumerate(order, start=1)}
            | {(section, "PU"): 3 + k % 2 for section in (1, 2)},
        )  # fmt: skip

    write_study(folder, "study-two", 10, make)
    return folder


@pytest.fixture(scope="module")
def results(study_two):
    return analyse_folder(study_two, load_study(study_two, unblind=True)).results


@pytest.fixture(scope="module")
def written(study_two):
    """The files of the command."""
    assert main([str(study_two), "--unblind", "--out", str(study_two / "out")]) == 0
    return study_two / "out"


def rows_of(chapter, name):
    found = next(table for table in chapter.tables if table.name == name)
    return [dict(zip(found.columns, row, strict=True)) for row in found.rows]


@pytest.mark.parametrize("construct", TABLE_1)
def test_table_1_has_the_papers_percentages(study_one, construct):
    rows = rows_of(study_one["acceptance"], "tam_answers")
    row = next(row for row in rows if row["construct"] == construct)
    assert list(row.values())[1:6] == [f"{share:g} %" for share in TABLE_1[construct]]
    assert row["answers"] == 16


def test_agreement_is_said_as_the_paper_says_it(study_one):
    said = study_one["acceptance"].says[0]
    for words in ("PU 68.75 %", "PENJ 87.5 %", "DE 81.25 %", "ITU 62.5 %", "IE 56.25 %"):
        assert words in said


def test_the_papers_shares_of_raised_heart_rates_come_back(study_one):
    found = {f.question: f.estimate for f in study_one["heart-rate"].findings}
    assert found["share of games with peak above resting"].value == 1.0
    assert found["share of games with peak above walking"].value == 296 / 320
    raised = found["share of games with peak 20 % or more above walking"]
    assert round(100 * raised.value) == 29
    assert raised.low < raised.value < raised.high
    assert "58 % above walking" in study_one["heart-rate"].says[0]


def test_the_warm_start_is_ranked_least_and_both_rankings_go_together(study_one):
    findings = study_one["rankings"].findings
    pairs = [f for f in findings if f.question.startswith("enjoyment: warm-start - ")]
    assert len(pairs) == 3
    assert all(pair.is_significant and pair.estimate.value < 0.0 for pair in pairs)
    together = next(f for f in findings if f.question == "ranks of enjoyment and difficulty")
    assert together.effect.value == pytest.approx(1.0)


def test_adjectives_are_counted_by_condition(study_one):
    rows = {row["option"]: row for row in rows_of(study_one["answers"], "chosen_adjectives")}
    assert rows["Exciting"]["times"] == 32
    assert rows["Boring"]["share"] == "50 %"
    assert rows["Exciting"]["warm-start"] == "100 % (16)"


@pytest.mark.parametrize(
    ("condition", "slope", "r", "p", "mean"),
    [("baseline", 30.0, 0.56, "9.3e-10", 383.5), ("rl", 15.7, 0.34, "0.0005", 349.1)],
)
def test_the_papers_regression_of_study_two_comes_back(results, condition, slope, r, p, mean):
    rows = rows_of(results.chapter("learning"), "regression")
    row = next(row for row in rows if row["condition"] == condition)
    assert (row["games"], row["slope"], row["r"]) == (100, slope, r)
    assert f"{row['p']:.{1 if 'e' in p else 4}{'e' if 'e' in p else 'f'}}" == p
    rows = rows_of(results.chapter("scores"), "scores")
    assert next(row for row in rows if row["condition"] == condition)["mean"] == mean


def test_the_slopes_of_people_are_compared(results):
    findings = results.chapter("learning").findings
    found = next(f for f in findings if f.test == "paired t-test of slopes")
    assert found.question == "slope: baseline - rl"
    assert found.estimate.value == pytest.approx(14.3)
    model = next(f for f in findings if f.test.startswith("mixed model"))
    assert model.p is None or model.estimate.value == pytest.approx(14.3, rel=1e-3)


def test_seventy_percent_found_rl_more_intelligent(results):
    chapter = results.chapter("answers")
    found = next(f for f in chapter.findings if f.question == "more intelligent")
    assert (found.n, found.estimate.name, found.estimate.value) == (10, "chose rl", 0.7)
    people = {row["condition"]: row["people"] for row in rows_of(chapter, "choice_Q4")}
    assert people == {"rl": 7, "baseline": 2, "equally": 1}


def test_table_3_is_paired_and_says_where_nothing_differs(results):
    compared = rows_of(results.chapter("acceptance"), "tam_comparison")
    rows = {row["construct"]: row for row in compared}
    assert (rows["PU"]["t"], rows["PU"]["p"]) == (None, None)
    first = np.array([(3, 4, 5, 3)[k % 4] for k in range(10)])
    second = np.array([(4, 4, 3, 5)[k % 4] for k in range(10)])
    difference = first - second
    t = difference.mean() / (difference.std(ddof=1) / np.sqrt(10))
    assert rows["PEOU"]["t"] == pytest.approx(t, abs=0.005)
    assert rows["PEOU"]["median baseline"] == 3.5
    findings = results.chapter("acceptance").findings
    assert next(f for f in findings if f.question.startswith("PU")).note == "not done: all are zero"
    assert next(f for f in findings if f.question.startswith("ATT")).n == 0


@pytest.mark.slow
def test_what_people_wrote_is_neither_html_nor_a_formula(written):
    page = (written / "report.html").read_text()
    assert "<b>defensive</b>" not in page
    assert "&lt;b&gt;defensive" in page
    with (written / "words.csv").open(newline="") as file:
        assert next(csv.DictReader(file))["answer"].startswith("'=cmd")


@pytest.mark.slow
def test_the_report_asks_nobody_for_anything(written):
    page = (written / "report.html").read_text()
    assert "default-src &#x27;none&#x27;" in page
    assert page.count("<svg") == 4
    for way_out in ("<script", 'src="http', 'href="http', "url(http", "@import"):
        assert way_out not in page
    assert "statsmodels" in page


@pytest.mark.slow
def test_the_results_are_the_same_again(written, tmp_path, results):
    main([str(written.parent), "--unblind", "--out", str(tmp_path)])
    for name in ("results.json", "report.html", "tests.csv"):
        assert (tmp_path / name).read_bytes() == (written / name).read_bytes()
    found = msgspec.json.decode((written / "results.json").read_bytes(), type=Results)
    assert found == results


@pytest.mark.slow
def test_a_study_of_which_only_one_person_has_played_is_analysed(tmp_path):
    study = study_in(tmp_path / "s", "study-one", people=4)
    play(study, "sub-02", is_repeated="s2-g01")
    assert main([str(study.folder)]) == 0
    found = msgspec.json.decode(
        (study.folder / "analysis" / "results.json").read_bytes(), type=Results
    )
    assert found.is_blinded
    assert found.chapter("people").says[0].startswith("1 of 16 planned people")
    assert "1 attempt left out: void, repeated or not ended" in found.chapter("people").says
    assert all(f.p is None for f in found.chapter("scores").findings)


def test_a_chapter_without_headlines_has_no_line_in_either_summary(study_one):
    told = dataclasses.replace(study_one["rankings"], pictures=())
    silent = dataclasses.replace(
        study_one["heart-rate"], says=("16 people left out",), headlines=0, pictures=()
    )
    methods = Methods(
        packages={}, python="", commit="", seed=0, protocol=(), config=(), policies=(), commits=()
    )
    page = report_page("A study", True, methods, [silent, told])
    assert "<b>Rankings. </b>" in page
    assert "<b>Heart rate. </b>" not in page
    chapters = tuple(
        ChapterResults(key=c.key, title=c.title, says=c.says, headlines=c.headlines, findings=(),
                       tables=())
        for c in (silent, told)
    )  # fmt: skip
    found = Results(study="s", title="A study", is_blinded=True, people=16, methods=methods,
                    chapters=chapters)  # fmt: skip
    assert "Rankings: " in summary_text(found)
    assert "Heart rate" not in summary_text(found)


def test_a_study_of_which_nobody_has_played_is_refused(tmp_path):
    study = study_in(tmp_path / "s", "study-two", people=4)
    with pytest.raises(RiposteError, match="nobody has taken part"):
        main([str(study.folder)])
