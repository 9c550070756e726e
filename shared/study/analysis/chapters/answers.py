"""Choices between robots, adjectives that were ticked, and answers in people's own words."""

from collections.abc import Sequence

from shared.study.analysis.chapter import Cell, Chapter, Table, p_words, percent_text
from shared.study.analysis.counts import choice
from shared.study.analysis.finding import Finding
from shared.study.analysis.games import Games, each
from shared.study.analysis.intervals import share_estimate
from shared.study.analysis.paired import holm
from shared.study.analysis.questionnaires import choice_items, chosen
from shared.study.protocol import Item
from shared.study.tables import Tables


def answers_chapter(tables: Tables, games: Games) -> Chapter | None:
    """Return choices, adjectives and open answers; None where there are none."""
    findings: list[Finding] = []
    made: list[Table] = []
    says: list[str] = []
    for _, item in choice_items(tables.protocol, is_several=False):
        if _names_sections(item) and (found := _choice(tables, games, item)) is not None:
            finding, table = found
            findings.append(finding)
            made.append(table)
    findings = list(holm(findings))
    says += [_choice_words(finding) for finding in findings]
    for _, item in choice_items(tables.protocol, is_several=True):
        if (counted := _counted(tables, games, item)) is not None:
            made.append(counted)
            says.append(_counted_words(counted))
    if (words := _open(tables)) is not None:
        made.append(words)
    if not made:
        return None
    return Chapter(key="answers", title="Choices, adjectives and words", says=tuple(says),
                   headlines=len(says),
                   findings=tuple(findings), tables=tuple(made))  # fmt: skip


def _names_sections(item: Item) -> bool:
    return all(f"Section {k}" in item.options for k in (1, 2))


def _choice(tables: Tables, games: Games, item: Item) -> tuple[Finding, Table] | None:
    """Return who chose which of two conditions; the order says which section was which."""
    if len(games.conditions) != 2:
        return None
    counts = dict.fromkeys(games.conditions, 0)
    neither = missing = 0
    answers = {person: options for (person, _), options in chosen(tables, item.id).items()}
    for person in games.people:
        options, order = answers.get(person, []), games.orders.get(person, ())
        numbers = [k for k in range(len(order)) if f"Section {k + 1}" in options]
        if not options or (numbers and len(order) != 2):
            missing += 1
        elif numbers:
            counts[order[numbers[0]]] += 1
        else:
            neither += 1
    if not sum(counts.values()) + neither:
        return None
    first, second = sorted(games.conditions, key=lambda name: -counts[name])
    question = f"more {item.construct}"
    finding = choice(counts[first], counts[second], neither, missing, (first, second), question)
    answered = sum(counts.values()) + neither
    rows: list[tuple[Cell, ...]] = []
    for name, count in ((first, counts[first]), (second, counts[second]), ("equally", neither)):
        share = share_estimate(count, answered, name)
        ends = f"{percent_text(share.low or 0.0)} to {percent_text(share.high or 1.0)}"
        rows.append((name, count, percent_text(share.value), ends))
    table = Table(
        name=f"choice_{item.id}", title=f"Which robot is more {item.construct}?",
        columns=("condition", "people", "share", "95 %"), rows=tuple(rows),
        note=f"Of {answered} people who answered; exact binomial intervals."
        + (f" {missing} did not answer." if missing else ""),
    )  # fmt: skip
    return finding, table


def _choice_words(finding: Finding) -> str:
    share = finding.estimate
    if share is None:
        return f"{finding.question.capitalize()}: {finding.note}."
    ends = f"{percent_text(share.low or 0.0)} to {percent_text(share.high or 1.0)}"
    name = share.name.removeprefix("chose ")
    tail = "" if finding.p is None else f"; {p_words(finding)} against a coin"
    return (f"{percent_text(share.value)} (95 %: {ends}) of people found {name} "
            f"{finding.question}{tail}.")  # fmt: skip


def _counted(tables: Tables, games: Games, item: Item) -> Table | None:
    """Return how many sections of each condition were described by each option."""
    found = {at: options for at, options in chosen(tables, item.id).items()
             if at[0] in games.people and at[1] <= len(games.orders.get(at[0], ()))}  # fmt: skip
    if not found:
        return None
    of = {name: [options for (person, section), options in found.items()
                 if section and games.orders[person][section - 1] == name]
          for name in games.conditions}  # fmt: skip
    of = {name: sections for name, sections in of.items() if sections} or {
        "everybody": list(found.values())
    }
    every = [options for sections in of.values() for options in sections]
    rows: list[tuple[Cell, ...]] = []
    for option in item.options:
        total = sum(option in options for options in every)
        rows.append((
            option, total, percent_text(total / len(every)),
            *(_share(option, sections) for sections in of.values()),
        ))  # fmt: skip
    counts = ", ".join(f"{name} {len(sections)}" for name, sections in of.items())
    return Table(
        name=f"chosen_{item.id}", title=f"How often each was chosen: {item.construct}",
        columns=("option", "times", "share", *of), rows=tuple(rows),
        note=f"Share of {len(every)} answers ({counts}).",
    )  # fmt: skip


def _share(option: str, sections: Sequence[Sequence[str]]) -> str:
    count = sum(option in options for options in sections)
    return f"{percent_text(count / len(sections))} ({count})"


def _counted_words(table: Table) -> str:
    ordered = sorted(table.rows, key=lambda row: -int(row[1] or 0))
    top = ", ".join(f"{row[0]} ({row[2]})" for row in ordered[:3])
    return f"Most often chosen of {table.title.rpartition(': ')[2]}: {top}."


def _open(tables: Tables) -> Table | None:
    rows = [
        (person, condition if section else "", item, text)
        for person, section, condition, item, construct, text in each(
            tables.questionnaire, "participant", "section", "condition", "item", "construct",
            "text",
        )
        if text.strip() and construct != "age"
    ]  # fmt: skip
    if not rows:
        return None
    return Table(
        name="words", title="In people's own words",
        columns=("participant", "condition", "question", "answer"), rows=tuple(rows),
        note="As they were written: read them before you show this page to others.",
        is_folded=True,
    )  # fmt: skip
