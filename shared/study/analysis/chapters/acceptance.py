"""The technology acceptance model and other scales: shares, medians, reliability, comparisons."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.chapter import (
    Cell,
    Chapter,
    Picture,
    Table,
    estimate_words,
    interval_text,
    p_text,
    p_words,
    percent_text,
    significant,
)
from shared.study.analysis.counts import cronbach_alpha, percentages
from shared.study.analysis.finding import Finding
from shared.study.analysis.games import Games, mean_of
from shared.study.analysis.intervals import share_estimate
from shared.study.analysis.paired import Named, holm, paired
from shared.study.analysis.questionnaires import Scale, choice_items, chosen, scales_of
from shared.study.analysis.repeated import repeated_anova
from shared.study.tables import Tables
from shared.telemetry.study_figures import answer_bars
from shared.telemetry.wording import listing

Floats = NDArray[np.float64]


def acceptance_chapter(
    tables: Tables, games: Games, generator: np.random.Generator
) -> Chapter | None:
    """Return what people answered on scales, None where nothing was asked."""
    scales = scales_of(tables, games.people, games.conditions)
    if not scales:
        return None
    says: list[str] = []
    findings: list[Finding] = []
    tables_made: list[Table] = []
    pictures: list[Picture] = []
    for scale in scales:
        made = _answers(scale)
        tables_made += [made, _reliability(scale)]
        says += _agreement(scale)
        pictures.append(_picture(scale))
        if len(scale.conditions) > 1:
            compared = _compared(scale, generator)
            findings += compared
            tables_made.append(_comparison(scale, compared))
            says.append(_difference(scale, compared))
        tables_made += _by_group(tables, games, scale)
    return Chapter(
        key="acceptance", title="Acceptance", says=tuple(says), headlines=len(says),
        findings=tuple(findings),
        tables=tuple(tables_made), pictures=tuple(pictures),
    )  # fmt: skip


def _answers(scale: Scale) -> Table:
    """Return the paper's table 1."""
    labels = scale.instrument.labels or ("",) * scale.points
    options = [f"{k} {label}".strip() for k, label in enumerate(labels, start=1)]
    rows: list[tuple[Cell, ...]] = []
    for construct in scale.constructs:
        for k, condition in enumerate(scale.conditions):
            answers = scale.of(construct)[:, k]
            there = answers[np.isfinite(answers)]
            shares = percentages(answers.ravel(), scale.points)
            medians = mean_of(answers)
            people = medians[np.isfinite(medians)]
            rows.append((
                construct, *((condition,) if condition else ()),
                *(f"{share:g} %" for share in np.round(shares, 2)),
                float(np.median(people)) if len(people) else None, len(there),
            ))  # fmt: skip
    several = any(scale.of(construct).shape[2] > 1 for construct in scale.constructs)
    return Table(
        name=f"{scale.instrument.name}_answers",
        title=f"{scale.instrument.title}: answers by construct",
        columns=("construct", *(("condition",) if scale.conditions != ("",) else ()), *options,
                 "median", "answers"),
        rows=tuple(rows),
        note="Share of the answers; a missing answer is left out, a reversed item turned round."
        + (" The median is over people's means of a construct's items." if several else ""),
    )  # fmt: skip


def _reliability(scale: Scale) -> Table:
    rows: list[tuple[Cell, ...]] = []
    whole = scale.items.transpose(1, 0, 2).reshape(-1, scale.items.shape[2])
    everything = [("all items", whole)]
    for construct in scale.constructs:
        items = scale.of(construct).transpose(1, 0, 2)
        everything.append((construct, items.reshape(-1, items.shape[2])))
    for name, items in everything:
        alpha = cronbach_alpha(items)
        complete = int(np.isfinite(items).all(axis=1).sum())
        value = None if alpha is None else round(alpha.value, 3)
        why = "" if alpha is not None else "one item has none" if items.shape[1] < 2 else "too few"
        rows.append((name, items.shape[1], complete, value, interval_text(alpha), why))
    return Table(
        name=f"{scale.instrument.name}_alpha",
        title=f"{scale.instrument.title}: Cronbach's alpha",
        columns=("items", "how many", "complete answers", "alpha", "95 %", "note"),
        rows=tuple(rows),
        note="Interval by Feldt. Answered after several sections, the answers of one person are "
        "taken together, which makes the interval too narrow."
        if len(scale.conditions) > 1
        else "Interval by Feldt.",
        is_folded=True,
    )


def _agreement(scale: Scale) -> list[str]:
    if scale.conditions != ("",) or scale.points != 5:
        return []
    parts: list[str] = []
    for construct in scale.constructs:
        answers = scale.of(construct)
        there = answers[np.isfinite(answers)]
        if len(there):
            parts.append(f"{construct} {100.0 * float(np.mean(there >= 4.0)):.4g} %")
    return [f"Agreed or strongly agreed: {', '.join(parts)}."] if parts else []


def _compared(scale: Scale, generator: np.random.Generator) -> tuple[Finding, ...]:
    """Return the paper's table 3: every construct, tested within people, Holm over constructs."""
    found: list[Finding] = []
    for construct in scale.constructs:
        means = mean_of(scale.of(construct))
        if len(scale.conditions) == 2:
            question = f"{construct}: {scale.conditions[0]} - {scale.conditions[1]}"
            found.append(paired(means[:, 0], means[:, 1], Named(question)))
        else:
            question = f"{construct} over {len(scale.conditions)} conditions"
            found.append(repeated_anova(means, question, generator))
    return holm(found)


def _comparison(scale: Scale, findings: Sequence[Finding]) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for construct, finding in zip(scale.constructs, findings, strict=True):
        means = mean_of(scale.of(construct))
        there = [column[np.isfinite(column)] for column in means.T]
        rows.append((
            construct, *(float(np.median(c)) if len(c) else None for c in there),
            *(round(float(c.mean()), 2) if len(c) else None for c in there),
            None if finding.statistic is None else round(finding.statistic, 2),
            finding.p, finding.p_adjusted, finding.n,
        ))  # fmt: skip
    symbol = findings[0].symbol or "t"
    return Table(
        name=f"{scale.instrument.name}_comparison",
        title=f"{scale.instrument.title}: conditions compared",
        columns=("construct", *(f"median {name}" for name in scale.conditions),
                 *(f"mean {name}" for name in scale.conditions), symbol, "p", "p (Holm)", "people"),
        rows=tuple(rows),
        note="Within people. Where all differences are equal there is no test.",
    )  # fmt: skip


def _difference(scale: Scale, findings: Sequence[Finding]) -> str:
    name = scale.instrument.title
    found = significant(findings)
    if not found:
        tested = [finding for finding in findings if finding.p is not None]
        least = min((p for p in (f.decisive_p for f in tested) if p is not None), default=None)
        smallest = "" if least is None else f" (smallest p after Holm: {p_text(least)})"
        return f"{name}: no construct differs significantly between conditions{smallest}."
    words = [
        f"{finding.question} {estimate_words(finding.estimate)}, {p_words(finding)}"
        if finding.estimate is not None
        else f"{finding.question}, {p_words(finding)}"
        for finding in found
    ]
    return f"{name}: {listing(words)}; no other construct differs significantly."


def _by_group(tables: Tables, games: Games, scale: Scale) -> list[Table]:
    """Return agreement by how people described themselves, as the paper does for exercise."""
    if scale.conditions != ("",) or scale.points != 5:
        return []
    rows: list[tuple[Cell, ...]] = []
    for _, item in choice_items(tables.protocol, is_several=False):
        found = chosen(tables, item.id)
        if item.construct != "exercise-hours":
            continue
        for option in item.options:
            group = [k for k, person in enumerate(games.people)
                     if option in found.get((person, 0), [])]  # fmt: skip
            for construct in scale.constructs:
                means = mean_of(scale.of(construct))[group, 0]
                there = means[np.isfinite(means)]
                if len(there):
                    agree = int(np.sum(there >= 4.0))
                    share = share_estimate(agree, len(there), option)
                    rows.append((
                        option, construct, agree, len(there), percent_text(share.value),
                        f"{percent_text(share.low or 0.0)} to {percent_text(share.high or 1.0)}",
                    ))  # fmt: skip
    if not rows:
        return []
    return [
        Table(name=f"{scale.instrument.name}_by_exercise",
              title=f"{scale.instrument.title}: who agreed, by weekly exercise",
              columns=("exercise", "construct", "agreed", "of", "share", "95 %"),
              rows=tuple(rows), note="Agreed: 4 or more; exact binomial intervals.",
              is_folded=True),
    ]  # fmt: skip


def _picture(scale: Scale) -> Picture:
    bars: list[tuple[str, Sequence[float]]] = []
    for construct in scale.constructs:
        for k, condition in enumerate(scale.conditions):
            shares = percentages(scale.of(construct)[:, k].ravel(), scale.points)
            bars.append((f"{construct} {condition}".strip(), shares.tolist()))
    options = scale.instrument.labels or tuple(str(k + 1) for k in range(scale.points))
    return Picture(
        lambda: answer_bars(bars, options),
        "Answers by construct (share of people); the middle answer is split around zero, so that "
        "agreement reaches to the right.",
    )
