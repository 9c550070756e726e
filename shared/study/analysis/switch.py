"""Whether a switch of the opponent sets people back, the opponents' own difficulty taken out."""

# pyright: basic
# (scipy's types are partial)

import math

import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy import stats

from shared.study.analysis.finding import Estimate, Finding, missing_text, not_done
from shared.study.analysis.games import Games
from shared.study.analysis.intervals import TAIL, effect_dz
from shared.study.analysis.paired import NOTHING_VARIES, normality

Floats = NDArray[np.float64]
QUESTION = "change of score at a switch of the opponent - from game to game"
TEST = "t-test, the opponents' difficulty as covariate"
ESTIMATE = "mean difference at equal difficulty"


def switch_effect(games: Games) -> Finding:
    """Return whether scores change more at a switch of the opponent than from game to game.

    A person's value is the mean change from the last game of a section to the first of the next,
    less the mean change a game within sections. An opponent who is merely easier raises it for
    those who come to it and lowers it for those who leave it, and not for both on average: with
    each opponent as a covariate (1 where one comes to it, -1 where one leaves it, shared by the
    switches of a person) the intercept of least squares is what a switch does by itself. Where
    everybody has the same order nothing tells the two apart, and no test is done; sections that
    everybody begins with are left out for that.

    Args:
        games: of the study.
    """
    values, moved = _changes(games)
    there = np.isfinite(values)
    n = int(there.sum())
    left_out = missing_text(len(values) - n, "people", "no games on both sides of a switch")
    y, moved = values[there], moved[there]
    design = np.column_stack([np.ones(n), moved])
    rank = int(np.linalg.matrix_rank(design)) if n else 0
    if n and rank == int(np.linalg.matrix_rank(moved)):
        why = "all orders are alike, and nothing tells a switch from the opponents' difficulty"
        return not_done(QUESTION, TEST, n, why, left_out=left_out)
    if n - rank < 2:
        why = f"{n} people, {rank + 2} are needed to take the opponents' difficulty out"
        return not_done(QUESTION, TEST, n, why, left_out=left_out)
    inverse = np.linalg.pinv(design)
    fitted = inverse @ y
    residuals = y - design @ fitted
    value, df, share = float(fitted[0]), n - rank, float(inverse[0] @ inverse[0])
    error = math.sqrt(float(residuals @ residuals) / df * share)
    if error <= NOTHING_VARIES * max(1.0, float(np.max(np.abs(y)))):
        bare = Estimate(name=ESTIMATE, value=value)
        made = not_done(QUESTION, TEST, n, "nothing varies", left_out=left_out)
        return msgspec.structs.replace(made, estimate=bare)
    t, half = value / error, float(stats.t.ppf(1.0 - TAIL, df)) * error
    return Finding(
        question=QUESTION,
        test=TEST,
        n=n,
        symbol="t",
        statistic=t,
        df=(float(df),),
        p=float(2.0 * stats.t.sf(abs(t), df)),
        estimate=Estimate(
            name=ESTIMATE, value=value, low=value - half, high=value + half, method="t"
        ),
        effect=effect_dz(t, 1.0 / share, df),
        checks=normality(residuals, "residuals are normal"),
        left_out=left_out,
    )


def _changes(games: Games) -> tuple[Floats, Floats]:
    """Return float64[n], everybody's value, and float64[n, C], where their switches went."""
    people, sections, _ = games.by_section.shape
    values = np.full(people, np.nan)
    moved = np.zeros((people, len(games.conditions)))
    for k, person in enumerate(games.people):
        jumps: list[float] = []
        rises: list[float] = []
        order = games.orders.get(person, ())[:sections]
        for section in range(len(games.first), len(order)):
            here = _played(games.by_section[k, section])
            if len(here) > 1:
                rises.append(float(here[-1] - here[0]) / (len(here) - 1))
            before = _played(games.by_section[k, section - 1]) if section else here[:0]
            if section > len(games.first) and len(here) and len(before):
                jumps.append(float(here[0] - before[-1]))
                moved[k, games.conditions.index(order[section])] += 1.0
                moved[k, games.conditions.index(order[section - 1])] -= 1.0
        if jumps and rises:
            values[k] = float(np.mean(jumps)) - float(np.mean(rises))
            moved[k] /= len(jumps)
    return values, moved


def _played(row: Floats) -> Floats:
    return row[np.isfinite(row)]
