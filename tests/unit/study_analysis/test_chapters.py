"""The tables of the chapters, of a study of four people whose numbers can be worked by hand."""

import platform
from importlib import metadata

import numpy as np
import pytest

from shared.study.analysis.chapters.acceptance import acceptance_chapter
from shared.study.analysis.chapters.heart_rate import heart_rate_chapter
from shared.study.analysis.chapters.people import people_chapter
from shared.study.analysis.chapters.rankings import rankings_chapter
from shared.study.analysis.chapters.scores import scores_chapter
from shared.study.analysis.chapters.strategy import strategy_chapter
from shared.study.analysis.games import games_of
from shared.study.analysis.methods import methods_of, paragraph
from shared.study.analysis.moves import moves_of
from shared.study.tables import load_study
from tests.unit.study_analysis.made import Person, write_study

WALKING = 100.0
PEAKS = [
    (100.0, 120.0, 140.0, 141.0),  # at the edges, which belong to the level below
    (90.0, 101.0, 121.0, 150.0),
    (110.0, 110.0, 130.0, 160.0),
    (99.0, 100.0, 100.5, 139.5),
]
"""Mean peak by person and section (1/min)."""
LOW, MEDIUM, HIGH, ULTRA = (
    "low, up to 100 %", "medium, 100 to 120 %", "high, 120 to 140 %", "ultra-high, over 140 %",
)  # fmt: skip
MEANS, STEPS = (100.0, 200.0, 300.0, 400.0), (1.0, 2.0, 4.0, 3.0)
"""Of a person's scores: the mean, and the step between the five of a section."""
BEST = {
    "warm-start": (394, 394, 394, 394, 397), "policy-1": (400, 400, 403, 397, 400),
    "policy-2": (400, 403, 403, 397, 397), "policy-3": (406, 406, 406, 406, 403),
}  # fmt: skip
"""The fourth person's: the same twenty scores, other conditions."""
RANKS = [(1, 2, 3, 4), (1, 3, 2, 4), (1, 2, 3, 4), (2, 2, 2, 2)]
"""By person and section."""
AGES = ("21", "25 years", "about thirty", "29.")


def felt(k, peak):
    """Return the adjectives of a section."""
    if peak <= 100.0:
        return ["Boring"]
    if peak <= 120.0:
        return ["Amusing", "Boring"] if k == 2 else ["Amusing"]
    if peak <= 140.0:
        return ["Exciting"]
    return ["Frustrating"] if k == 2 else ["Exciting", "Physically Demanding"]


def person(k, order):
    games = np.arange(-2.0, 3.0)
    ranks = {name: RANKS[k][section] for section, name in enumerate(order)}
    return Person(
        scores={name: BEST[name] if k == 3 else MEANS[k] + STEPS[k] * games for name in order},
        walking=WALKING,
        peaks={name: PEAKS[k][section] + 2.0 * games for section, name in enumerate(order)},
        answers={(section + 1, "adjectives"): felt(k, peak) for section, peak in
                 enumerate(PEAKS[k])}
        | {(0, "age"): AGES[k], (0, "PU"): 5 - k,
           (0, "exercise-hours"): ["3 hours or more" if k < 3 else "Less than 3 hours"]},
        ranks={"enjoyment": ranks},
    )  # fmt: skip


@pytest.fixture(scope="module")
def tables(tmp_path_factory):
    folder = tmp_path_factory.mktemp("four") / "study"
    write_study(folder, "study-one", 4, person)
    return load_study(folder, unblind=True)


@pytest.fixture(scope="module")
def games(tables):
    return games_of(tables)


@pytest.fixture(scope="module")
def heart(tables, games):
    return heart_rate_chapter(tables, games, np.random.default_rng(0))


def rows_of(chapter, name):
    found = next(table for table in chapter.tables if table.name == name)
    return [dict(zip(found.columns, row, strict=True)) for row in found.rows]


def test_a_section_has_the_level_of_its_mean_peak_and_an_edge_the_lower_one(heart):
    rows = [tuple(row.values()) for row in rows_of(heart, "heart_rate_levels")]
    assert rows == [
        (LOW, 4, "25 %"),
        (MEDIUM, 5, "31.2 %"),
        (HIGH, 4, "25 %"),
        (ULTRA, 3, "18.8 %"),
    ]
    rows = rows_of(heart, "heart_rate_people")
    assert [rows[0][f"level of section {k}"] for k in range(1, 5)] == [1.0, 1.2, 1.4, 1.41]
    assert (rows[3]["resting"], rows[3]["walking"]) == (70.0, 100.0)
    assert rows[3]["mean peak"] == pytest.approx((99.0 + 100.0 + 100.5 + 139.5) / 4, abs=0.05)


def test_adjectives_are_counted_by_the_level_of_their_section(heart):
    rows = {row.pop("adjective"): row for row in rows_of(heart, "adjectives_by_level")}
    columns = [f"{LOW} (n = 4)", f"{MEDIUM} (n = 5)", f"{HIGH} (n = 4)", f"{ULTRA} (n = 3)"]
    assert list(rows["Boring"]) == columns
    assert list(rows["Boring"].values()) == ["100 %", "40 %", "0 %", "0 %"]
    assert list(rows["Amusing"].values()) == ["0 %", "100 %", "0 %", "0 %"]
    assert list(rows["Exciting"].values()) == ["0 %", "0 %", "100 %", "66.7 %"]
    assert list(rows["Frustrating"].values()) == ["0 %", "0 %", "0 %", "33.3 %"]


def test_variance_goes_with_maximum_and_mean_as_worked_by_hand(tables, games, tmp_path):
    chapter = strategy_chapter(games, moves_of(tmp_path, games), np.random.default_rng(0))
    found = {finding.question: finding for finding in chapter.findings}
    # Variances are as the steps squared, 1, 4, 16, 9; maxima 102, 204, 308, 406.
    maximum = found["variance of a person's scores and their maximum"]
    assert maximum.statistic == pytest.approx(1850.0 / np.sqrt(129.0 * 51620.0))
    mean = found["variance of a person's scores and their mean"]
    assert mean.statistic == pytest.approx(1800.0 / np.sqrt(129.0 * 50000.0))
    assert "with the maximum r = 0.72" in chapter.says[0]
    assert "with the mean r = 0.71" in chapter.says[0]


def test_the_best_mean_of_a_person_is_told_with_whose_it_is(games):
    chapter = scores_chapter(games, np.random.default_rng(0))
    best = {row["condition"]: (row["best mean of a person"], row["whose"])
            for row in rows_of(chapter, "scores")}  # fmt: skip
    assert best == {
        "warm-start": (394.6, "sub-04"), "policy-1": (400.0, "sub-04"),
        "policy-2": (400.0, "sub-04"), "policy-3": (405.4, "sub-04"),
    }  # fmt: skip


def test_who_agreed_is_told_by_weekly_exercise(tables, games):
    chapter = acceptance_chapter(tables, games, np.random.default_rng(0))
    rows = {(row["exercise"], row["construct"]): tuple(row.values())[2:]
            for row in rows_of(chapter, "tam_by_exercise")}  # fmt: skip
    assert rows == {
        ("Less than 3 hours", "PU"): (0, 1, "0 %", "0 % to 97.5 %"),
        # 2 of 3: at the ends 3 p^2 - 2 p^3 and 1 - p^3 are a fortieth
        ("3 hours or more", "PU"): (2, 3, "66.7 %", "9.4 % to 99.2 %"),
    }


def test_ranks_by_section_share_ties(tables, games):
    chapter = rankings_chapter(tables, games, np.random.default_rng(0))
    rows = rows_of(chapter, "rank_enjoyment_by_section")
    assert [row["mean rank"] for row in rows] == [1.38, 2.38, 2.62, 3.62]
    assert [row["standard error"] for row in rows] == [0.38, 0.24, 0.24, 0.38]
    assert [row["most, alone"] for row in rows] == ["0 %", "0 %", "0 %", "75 %"]
    assert [row["least, alone"] for row in rows] == ["75 %", "0 %", "0 %", "0 %"]


def test_ages_that_are_numbers_have_a_mean_and_a_spread(tables, games):
    row = rows_of(people_chapter(tables, games), "participants")[0]
    assert tuple(row.values()) == ("age", "M 25.0, SD 4.00 years", 3)


def test_the_methods_name_versions_seed_and_whether_it_was_blinded(tables):
    methods = methods_of(tables, 1234)
    text = paragraph(methods, is_blinded=True)
    for name in ("numpy", "scipy", "statsmodels", "pandas"):
        assert f"{name} {metadata.version(name)}" in text
    assert f"Python {platform.python_version()}" in text
    assert "(1234)" in text
    assert "under blinded labels" in text
    assert "by name" in paragraph(methods, is_blinded=False)
    assert methods.protocol == tuple(set(tables.participants["protocol"]))
    assert methods.policies == tuple(f"sha256:{name}" for name in sorted(BEST))
    assert (methods.config, methods.commits) == (("c" * 64,), ("abc",))
