"""Strategy: do people whose scores vary reach more, and do the best move more variedly?"""

import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.chapter import (
    Cell,
    Chapter,
    Picture,
    Table,
    interval_text,
    number_text,
    p_words,
    significant,
)
from shared.study.analysis.correlation import pearson
from shared.study.analysis.finding import Finding, not_done
from shared.study.analysis.games import Games
from shared.study.analysis.moves import Moves
from shared.study.analysis.shuffles import shuffled_variance
from shared.study.analysis.variances import compare_variances
from shared.styles.features import FEATURES
from shared.telemetry.study_figures import RatioBar, ScatterPanel, ratio_bars, scatter_panels
from shared.telemetry.wording import listing

Floats = NDArray[np.float64]
EXTREME = 5
"""Best and worst people that are compared (paper)."""
PAPERS = ("displacement_x", "displacement_y", "displacement_z", "mean_velocity")
"""Features that the paper compared."""


def strategy_chapter(games: Games, moves: Moves, generator: np.random.Generator) -> Chapter | None:
    """Return how the spread of scores and of movement goes with success.

    Args:
        games: scores.
        moves: features of the human's bat in the archived games.
        generator: shuffles games.
    """
    scores = games.by_section.reshape(len(games.people), -1)
    played = np.isfinite(scores).sum(axis=1) >= 3
    if played.sum() < 1:
        return None
    variance, largest, mean = _of_people(scores)
    tests = [
        pearson(variance, largest, "variance of a person's scores and their maximum"),
        pearson(variance, mean, "variance of a person's scores and their mean"),
    ]
    shuffles = shuffled_variance(scores, generator)
    style, table, bars = _styles(games, moves, largest)
    says = _words(tests, shuffles)
    if style:
        says.append(_style_words(style))
    else:
        says.append(f"How varied people moved was not compared: {moves.reason}.")
    pictures = [
        Picture(
            lambda: scatter_panels([
                ScatterPanel("variance and maximum", variance, largest, "variance of scores",
                             "maximum score"),
                ScatterPanel("variance and mean", variance, mean, "variance of scores",
                             "mean score"),
            ]),
            "Each dot is a person.",
        )
    ]  # fmt: skip
    if bars:
        pictures.append(Picture(
            lambda: ratio_bars(bars),
            "Variance over games of how people moved their bat: the best people's over the "
            "worst's (geometric means, 95 %); above 1 the best moved more variedly.",
        ))  # fmt: skip
    return Chapter(
        key="strategy", title="Variety and success", says=tuple(says), headlines=3,
        findings=(*tests, *shuffles, *style), tables=table, pictures=tuple(pictures),
    )  # fmt: skip


def _of_people(scores: Floats) -> tuple[Floats, Floats, Floats]:
    rows = [row[np.isfinite(row)] for row in scores]
    enough = [len(row) >= 3 for row in rows]
    variance = [float(r.var(ddof=1)) if ok else np.nan for r, ok in zip(rows, enough, strict=True)]
    largest = [float(r.max()) if ok else np.nan for r, ok in zip(rows, enough, strict=True)]
    mean = [float(r.mean()) if ok else np.nan for r, ok in zip(rows, enough, strict=True)]
    return np.array(variance), np.array(largest), np.array(mean)


def _words(tests: list[Finding], shuffles: tuple[Finding, ...]) -> list[str]:
    parts: list[str] = []
    for what, test in zip(("maximum", "mean"), tests, strict=True):
        if test.effect is not None:
            parts.append(f"with the {what} r = {number_text(test.effect.value, 2)} "
                         f"(95 %: {interval_text(test.effect, 2)}; {p_words(test)})")  # fmt: skip
    said = [f"The variance of people's scores correlates {listing(parts)}."] if parts else []
    if shuffles and shuffles[0].p is not None and shuffles[0].estimate is not None:
        said.append(
            "A maximum is larger where games vary more, whoever plays: with games shuffled between "
            f"people the correlation with the maximum is "
            f"{number_text(shuffles[0].estimate.value, 2)} on average; the one found is "
            f"{'' if shuffles[0].is_significant else 'not '}significantly larger "
            f"({p_words(shuffles[0])})."
        )
    return said


def _styles(
    games: Games, moves: Moves, largest: Floats
) -> tuple[tuple[Finding, ...], tuple[Table, ...], list[RatioBar]]:
    if moves.features is None:
        return (), (), []
    features = moves.features.reshape(len(games.people), -1, len(FEATURES))
    counts = np.isfinite(features).all(axis=2).sum(axis=1)
    usable = np.flatnonzero((counts >= 3) & np.isfinite(largest))
    k = min(EXTREME, len(usable) // 2)
    question = "variance of movement, best - worst people"
    if k < 2:
        why = f"{len(usable)} people with 3 archived games, it needs 4"
        return (not_done(question, "Welch t-test of log variances", len(usable), why),), (), []
    ordered = usable[np.argsort(largest[usable], kind="stable")]
    worst, best = [int(p) for p in ordered[:k]], [int(p) for p in ordered[-k:]]
    variances = np.full((len(features), len(FEATURES)), np.nan)
    for person in usable:
        moved = features[person][np.isfinite(features[person]).all(axis=1)]
        variances[person] = moved.var(axis=0, ddof=1)
    found = compare_variances(
        variances[best], variances[worst],
        [f"variance of {feature.title}, {k} best over {k} worst people" for feature in FEATURES],
    )  # fmt: skip
    rows: list[tuple[Cell, ...]] = []
    bars: list[RatioBar] = []
    for index, (feature, finding) in enumerate(zip(FEATURES, found, strict=True)):
        means = variances[best, index].mean(), variances[worst, index].mean()
        more = means[0] / means[1] - 1.0 if means[1] > 0.0 else float("nan")
        rows.append((
            feature.title, "yes" if feature.name in PAPERS else "", float(f"{means[0]:.4g}"),
            float(f"{means[1]:.4g}"), f"{100 * more:+.0f} %", finding.p, finding.p_adjusted,
        ))  # fmt: skip
        if finding.estimate is not None and finding.estimate.low and finding.estimate.high:
            bars.append(RatioBar(feature.title, finding.estimate.value, finding.estimate.low,
                                 finding.estimate.high))  # fmt: skip
    table = Table(
        name="style_variance",
        title="Variance over games of how people moved their bat",
        columns=("feature", "in the paper", f"{k} best", f"{k} worst", "best more by", "p",
                 "p (Holm)"),
        rows=tuple(rows),
        note=f"Best and worst by maximum score: {', '.join(games.people[p] for p in best)} and "
        f"{', '.join(games.people[p] for p in worst)}. Mean variance in the feature's unit "
        f"squared; the test compares logarithms.{' ' + moves.note if moves.note else ''}",
    )  # fmt: skip
    return found, (table,), bars


def _style_words(found: tuple[Finding, ...]) -> str:
    if found[0].p is None and len(found) == 1:
        return (
            f"How varied people moved was not compared: {found[0].note.removeprefix('not done: ')}."
        )
    parts = [
        f"{feature.title} {number_text(finding.estimate.value, 2)}"
        for feature, finding in zip(FEATURES, found, strict=True)
        if feature.name in PAPERS and finding.estimate is not None
    ]
    some = significant(found)
    verdict = f"{len(some)} of {len(found)} features differ significantly after Holm"
    return (
        "The best people's movement varied from game to game by these factors of the worst's "
        f"variance: {', '.join(parts)}; {verdict if some else 'none differs significantly'}."
    )
