"""Studies made to have the paper's numbers give the paper's numbers, to the printed digit."""

import csv

import msgspec
import numpy as np
import pytest

from services.jobs.study.analyse import main
from shared.study.analysis.chapters.acceptance import acceptance_chapter
from shared.study.analysis.chapters.answers import answers_chapter
from shared.study.analysis.chapters.heart_rate import heart_rate_chapter
from shared.study.analysis.chapters.rankings import rankings_chapter
from shared.study.analysis.games import games_of
from shared.study.analysis.results import Results
from shared.study.tables import load_study
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


def read(folder):
    return msgspec.json.decode((folder / "results.json").read_bytes(), type=Results)


def table(folder, name):
    with (folder / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))


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
    assert main([str(folder), "--unblind", "--out", str(folder / "out")]) == 0
    return folder / "out"


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
    [("baseline", "30.0", "0.56", "9.3e-10", 383.5), ("rl", "15.7", "0.34", "0.0005", 349.1)],
)
def test_the_papers_regression_of_study_two_comes_back(study_two, condition, slope, r, p, mean):
    row = next(row for row in table(study_two, "regression") if row["condition"] == condition)
    assert (row["games"], row["slope"], row["r"]) == ("100", slope, r)
    assert f"{float(row['p']):.{1 if 'e' in p else 4}{'e' if 'e' in p else 'f'}}" == p
    scores = next(row for row in table(study_two, "scores") if row["condition"] == condition)
    assert float(scores["mean"]) == mean


def test_seventy_percent_found_rl_more_intelligent(study_two):
    chapter = read(study_two).chapter("answers")
    found = next(f for f in chapter.findings if f.question == "more intelligent")
    assert (found.n, found.estimate.name, found.estimate.value) == (10, "chose rl", 0.7)
    rows = table(study_two, "choice_Q4")
    assert [(row["condition"], row["people"]) for row in rows] == [
        ("rl", "7"), ("baseline", "2"), ("equally", "1"),
    ]  # fmt: skip


def test_table_3_is_paired_and_says_where_nothing_differs(study_two):
    rows = {row["construct"]: row for row in table(study_two, "tam_comparison")}
    assert (rows["PU"]["t"], rows["PU"]["p"]) == ("", "")
    first = np.array([(3, 4, 5, 3)[k % 4] for k in range(10)])
    second = np.array([(4, 4, 3, 5)[k % 4] for k in range(10)])
    difference = first - second
    t = difference.mean() / (difference.std(ddof=1) / np.sqrt(10))
    assert float(rows["PEOU"]["t"]) == pytest.approx(t, abs=0.005)
    assert float(rows["PEOU"]["median baseline"]) == 3.5
    findings = read(study_two).chapter("acceptance").findings
    assert next(f for f in findings if f.question.startswith("PU")).note == "not done: all are zero"
    assert next(f for f in findings if f.question.startswith("ATT")).n == 0


def test_what_people_wrote_is_neither_html_nor_a_formula(study_two):
    page = (study_two / "report.html").read_text()
    assert "<b>defensive</b>" not in page
    assert "&lt;b&gt;defensive" in page
    assert table(study_two, "words")[0]["answer"].startswith("'=cmd")


def test_the_report_asks_nobody_for_anything(study_two):
    page = (study_two / "report.html").read_text()
    assert "default-src &#x27;none&#x27;" in page
    assert page.count("<svg") == 4
    for way_out in ("<script", 'src="http', 'href="http', "url(http", "@import"):
        assert way_out not in page
    assert "statsmodels" in page


@pytest.mark.slow
def test_the_results_are_the_same_again(study_two, tmp_path):
    main([str(study_two.parent), "--unblind", "--out", str(tmp_path)])
    for name in ("results.json", "report.html", "tests.csv"):
        assert (tmp_path / name).read_bytes() == (study_two / name).read_bytes()
