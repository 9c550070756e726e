"""What all records say together: rates with intervals, errors, and who was taken for whom."""

import itertools
import math
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.identification.judging import Judged, judged
from services.jobs.bench import Check
from shared.identification.hidden.choosing import EVENTS

_Z = 1.96
SEEN = (-10.0, 0.02, 0.05, 0.1, 0.2, 0.4, 1.0)
"""Edges of the curve over how much of what the base fit leaves a hidden effect takes off."""
LEAST = 0.02
"""Of it, from which on an effect can be asked for."""


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a rate (Wilson 1927)."""
    if not count:
        return 0.0, 1.0
    rate, spread = hits / count, _Z**2 / count
    middle = (rate + spread / 2) / (1 + spread)
    half = _Z * math.sqrt(rate * (1 - rate) / count + spread / (4 * count)) / (1 + spread)
    low, high = middle - half, middle + half
    return (low if hits else 0.0), (high if hits < count else 1.0)  # rounding leaves 3e-17 of 0


def checks_of(records: Sequence[dict[str, Any]]) -> tuple[Check, ...]:
    """Return every figure that has a target, those of cells that were run; the main one first."""
    done = [record for record in records if "error" not in record]
    cells: dict[str, list[Judged]] = defaultdict(list)
    for record in done:
        cells[record["cell"]].append(judged(record))
    single = cells["single"]
    named = [each for each in single if each.has_place]
    errors = [error for each in named for error in each.errors]
    covered = [hit for each in named for hit in each.covered]
    able = [
        (record, judged(record))
        for record in done
        if record["cell"] == "single" and taken_off(record) >= LEAST
    ]
    removed = [
        _removed(record)
        for record, said in able
        if "explainable" in record and said.has_effect and record["hidden"][0]["name"] not in EVENTS
    ]
    found = [
        _rate("right effect", single, lambda each: each.has_effect, 0.90),
        _rate(
            f"right effect, of those that take {LEAST:.0%} off what the base leaves",
            [said for _, said in able],
            lambda each: each.has_effect,
            0.90,
        ),
        _rate("effect and place", single, lambda each: each.has_place, 0.85),
        _rate("named or in the tie", single, lambda each: each.has_tie, 0.98),
        _rate("a false name beside it", single, lambda each: each.false_names > 0, None),
        _rate("false names, base right", cells["null"], _is_false, 0.05, "at most"),
        _rate("false names, base imperfect", cells["null_imperfect"], _is_false, 0.10, "at most"),
        _rate("both of two", cells["two"], lambda each: each.has_effect, 0.80),
        _rate("at least one of two", cells["two"], lambda each: each.has_one, 0.97),
        _rate("a third name beside two", cells["two"], _is_false, 0.05, "at most"),
        _rate("outside: a wrong name", cells["outside"], _is_false, 0.10, "at most"),
        _rate("structural tie reported", cells["tie"], lambda each: each.is_tied, 1.0),
    ]
    apart = [record["is_told_apart"] for record in done if "is_told_apart" in record]
    found.append(_share("what a tie asks for tells it", sum(apart), len(apart), 0.90))
    outside = [record for record in done if record["cell"] == "outside"]
    raised = sum(bool(record["unexplained"]) or not record["named"] for record in outside)
    found.append(_share("outside: unexplained raised", raised, len(outside), 0.90))
    if errors:
        found.append(_at_most("error of the size, median", float(np.median(errors)), 0.05))
        found.append(
            _at_most("error of the size, 90th percentile", float(np.quantile(errors, 0.9)), 0.20)
        )
        found.append(_share("95 % intervals cover", sum(covered), len(covered), 0.90))
    if removed:
        found.append(
            Check(name="explainable removed, median", value=float(np.median(removed)), goal=0.95)
        )
        found.append(
            Check(
                name="explainable removed, 10th percentile",
                value=float(np.quantile(removed, 0.1)),
                goal=0.80,
            )
        )
    if done:
        cpu = [record["cpu_s"] for record in done]
        found.append(_at_most("CPU s a data set, median", float(np.median(cpu)), 60.0))
        found.append(_at_most("CPU s a data set, largest", max(cpu), None))
    found += _baselines(done)
    failed = len(records) - len(done)
    found.append(_at_most("data sets that ended in an error", float(failed), 0.0))
    return tuple(each for each in found if not math.isnan(each.value))


def confusion(records: Sequence[dict[str, Any]]) -> dict[str, dict[str, int]]:
    """Return, for each hidden effect, what was said how often; words of verdicts in brackets."""
    rows: dict[str, Counter[str]] = defaultdict(Counter)
    for record in records:
        if "error" in record or record["cell"] not in ("single", "null", "null_imperfect"):
            continue
        found = judged(record)
        rows[found.hidden[0] if found.hidden else "(nothing)"][found.said] += 1
    return {name: dict(rows[name].most_common()) for name in sorted(rows)}


def curve(records: Sequence[dict[str, Any]]) -> list[dict[str, float]]:
    """Return how often the right effect is named, by how much of the residual it takes off."""
    out: list[dict[str, float]] = []
    for low, high in itertools.pairwise(SEEN):
        within = [
            judged(record).has_effect
            for record in records
            if "error" not in record and record["cell"] == "single"
            and low <= taken_off(record) < high
        ]  # fmt: skip
        if within:
            out.append({"from": low, "to": high, "n": len(within), "named": float(np.mean(within))})
    return out


def taken_off(record: dict[str, Any]) -> float:
    """Return the share of what the base fit leaves that the hidden effect takes off.

    By a fit from the truth, see ``explainable``; in records of before there was one, by what the
    finder made of it, and for an event by what it was sized to.
    """
    if "explainable" in record:
        return float(record["explainable"])
    (hidden,) = record["hidden"]
    return float(hidden["share"]) if hidden["name"] in EVENTS else _found(record)


def _removed(record: dict[str, Any]) -> float:
    """Return the share of what can be explained that the finder's model takes off, at most all."""
    return min(_found(record) / float(record["explainable"]), 1.0)


def _found(record: dict[str, Any]) -> float:
    """Return the share of what the base fit leaves held out that the finder's model takes off."""
    return float(1.0 - (record["extended"] / record["base_fit"]) ** 2)


def confusion_text(records: Sequence[dict[str, Any]]) -> str:
    """Return the confusion matrix as a person reads it: one line for each hidden effect."""
    lines: list[str] = []
    for name, row in confusion(records).items():
        count = sum(row.values())
        right = row.get(name, 0)
        others = ", ".join(f"{said} {number}" for said, number in row.items() if said != name)
        lines.append(f"{name:<22} {right:>3}/{count:<3} {others}")
    return "\n".join(lines)


def _is_false(each: Judged) -> bool:
    return each.false_names > 0


def _rate(
    name: str, among: Sequence[Judged], is_hit: Callable[[Judged], bool], goal: float | None,
    goal_is: Any = "at least",
) -> Check:  # fmt: skip
    return _share(name, sum(map(is_hit, among)), len(among), goal, goal_is)


def _share(
    name: str, hits: int, count: int, goal: float | None, goal_is: Any = "at least"
) -> Check:
    low, high = wilson(hits, count)
    value = hits / count if count else math.nan
    return Check(
        name=f"{name} (n = {count})", value=value, goal=goal, goal_is=goal_is, low=low, high=high
    )


def _at_most(name: str, value: float, goal: float | None) -> Check:
    return Check(name=name, value=value, goal=goal, goal_is="at most")


def _baselines(records: Sequence[dict[str, Any]]) -> list[Check]:
    """Return the same figures of the baselines, on the data sets that they ran on."""
    with_them = [
        record for record in records if "baselines" in record and record["cell"] == "single"
    ]
    found: list[Check] = []
    for name in ("base_only", "all_at_once", "mlp"):
        shares = [record["baselines"][name]["share_removed"] for record in with_them]
        if not shares:
            continue
        right = sum(
            record["baselines"][name]["name"] == record["hidden"][0]["name"] for record in with_them
        )
        found.append(_share(f"baseline {name}: right effect", right, len(shares), None))
        found.append(
            Check(
                name=f"baseline {name}: explainable removed, median", value=float(np.median(shares))
            )
        )
    return found
