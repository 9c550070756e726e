"""A finder's verdict beside the truth, as one record; and what the record says."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.identification.protocol import Trial
from shared.identification.hidden.truth import HiddenEffect, Truth
from shared.identification.verdict import Cause, Verdict


def record_of(trial: Trial, truth: Truth, verdict: Verdict, cpu_s: float) -> dict[str, Any]:
    """Return what is kept of a trial."""
    held = verdict.held_out
    return {
        "key": trial.key,
        "cell": trial.cell,
        "arm": truth.arm,
        "seed": truth.seed,
        "hidden": [_plain(each) for each in truth.effect],
        "verdict": verdict.verdict,
        "named": [_cause(each) for each in verdict.causes],
        "ties": [[_cause(each) for each in tie.causes] for tie in verdict.ties],
        "unexplained": len(verdict.unexplained),
        "unexplained_most": max(
            (each.times_noise for each in verdict.unexplained if not each.is_external), default=0.0
        ),
        "nominal": held.nominal,
        "base_fit": held.base_fit,
        "extended": held.extended,
        "share_removed": held.share_removed,
        "starts_agree": verdict.starts_agree,
        "cpu_s": cpu_s,
    }


def _plain(effect: HiddenEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "where": effect.where,
        "share": effect.share,
        "values": {each.name: [each.value, each.unit] for each in effect.quantities},
    }


def _cause(cause: Cause) -> dict[str, Any]:
    return {
        "name": cause.effect,
        "where": cause.where,
        "quantity": cause.quantity,
        "value": cause.value,
        "interval": [cause.interval.low, cause.interval.high],
        "others": dict(cause.others),
        "other_intervals": {
            name: [each.low, each.high] for name, each in cause.other_intervals.items()
        },
    }


@dataclass(frozen=True)
class Judged:
    """What one record says."""

    cell: str
    hidden: tuple[str, ...]
    said: str
    """What the verdict comes to: an effect, or a word in brackets."""
    has_effect: bool
    """Every hidden effect is among those named."""
    has_one: bool
    """At least one is."""
    has_place: bool
    """Every one is named, with its place."""
    has_tie: bool
    """Every one is named or in a tie."""
    is_tied: bool
    """Every one is in a tie."""
    false_names: int
    """Named that are not hidden, ties that have none of the hidden ones."""
    errors: tuple[float, ...]
    """Relative errors of the size of what was named with its place."""
    covered: tuple[bool, ...]
    """Whether the 95 % intervals have the true sizes in them."""


def judged(record: dict[str, Any]) -> Judged:
    """Return what a record says."""
    hidden: list[dict[str, Any]] = record["hidden"]
    named: list[dict[str, Any]] = record["named"]
    ties: list[list[dict[str, Any]]] = record["ties"]
    names = {each["name"] for each in named}
    in_ties = {each["name"] for tie in ties for each in tie}
    wanted = [each["name"] for each in hidden]
    pairs = [
        (one, other)
        for one in hidden
        for other in named
        if one["name"] == other["name"] and one["where"] == other["where"]
    ]
    lone_ties = [tie for tie in ties if not {each["name"] for each in tie} & set(wanted)]
    word = record["verdict"]
    first = named[0]["name"] if named else f"({word})"
    return Judged(
        cell=record["cell"],
        hidden=tuple(wanted),
        said=first,
        has_effect=bool(wanted) and set(wanted) <= names,
        has_one=bool(set(wanted) & names),
        has_place=bool(wanted) and len(pairs) >= len(wanted),
        has_tie=bool(wanted) and set(wanted) <= names | in_ties,
        is_tied=bool(wanted) and set(wanted) <= in_ties,
        false_names=len(names - set(wanted)) + len(lone_ties),
        errors=tuple(_error(one, other) for one, other in pairs),
        covered=tuple(_is_covered(one, other) for one, other in pairs),
    )


def _error(hidden: dict[str, Any], cause: dict[str, Any]) -> float:
    """Return how far the numbers in the unit of the first are off, relative to their length."""
    values: dict[str, list[Any]] = hidden["values"]
    unit = values[cause["quantity"]][1]
    found = {cause["quantity"]: cause["value"], **cause["others"]}
    same = [name for name, (_, its) in values.items() if its == unit]
    true = np.array([values[name][0] for name in same])
    off = np.array([found.get(name, 0.0) for name in same]) - true
    return float(np.linalg.norm(off) / np.linalg.norm(true))


def _is_covered(hidden: dict[str, Any], cause: dict[str, Any]) -> bool:
    low, high = cause["interval"]
    return bool(low <= hidden["values"][cause["quantity"]][0] <= high)
