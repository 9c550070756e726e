"""A part of the report: what it says in plain sentences, its tests, its tables and its pictures."""

import dataclasses
import math
from collections.abc import Callable, Sequence

import msgspec

from shared.study.analysis.finding import ALPHA, Estimate, Finding

Cell = str | float | int | None
MINUS = "\N{MINUS SIGN}"


class Table(msgspec.Struct, frozen=True, kw_only=True):
    """A table of the report, and a CSV file of the same name."""

    name: str
    """Of the file, without its ending."""
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    note: str = ""
    is_folded: bool = False
    """Shown only when asked for."""


@dataclasses.dataclass(frozen=True)
class Picture:
    """A drawing that is made when the report is."""

    draw: Callable[[], str]
    """Returns SVG text."""
    caption: str


@dataclasses.dataclass(frozen=True)
class Chapter:
    """One part of the report."""

    key: str
    title: str
    says: tuple[str, ...] = ()
    """Plain sentences, the most important first."""
    headlines: int = 1
    """How many of them stand in the summary."""
    findings: tuple[Finding, ...] = ()
    tables: tuple[Table, ...] = ()
    pictures: tuple[Picture, ...] = ()


def number_text(value: float | None, digits: int = 3) -> str:
    """Return a number with so many significant digits, all before the point, a proper minus."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0.0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    return f"{value:,.{places}f}".replace("-", MINUS)


def p_text(p: float | None) -> str:
    """Return a p value as journals print it: ``0.013``, ``< 0.001``."""
    if p is None or not math.isfinite(p):
        return "-"
    return "< 0.001" if p < 0.001 else f"{p:.3f}" if p < 0.0995 else f"{p:.2f}"


def p_words(finding: Finding) -> str:
    """Return the p to judge by in words: ``p = 0.013``, ``p < 0.001 after Holm``."""
    text = p_text(finding.decisive_p)
    text = f"p {text}" if text.startswith("<") else f"p = {text}"
    return f"{text} after Holm" if finding.p_adjusted is not None else text


def interval_text(estimate: Estimate | None, digits: int = 3) -> str:
    """Return the 95 % interval, nothing where there is none."""
    if estimate is None or estimate.low is None or estimate.high is None:
        return ""
    return f"{number_text(estimate.low, digits)} to {number_text(estimate.high, digits)}"


def estimate_words(estimate: Estimate, digits: int = 3) -> str:
    """Return a number with its interval: ``30.0 (95 %: 21.2 to 38.8)``."""
    interval = interval_text(estimate, digits)
    value = number_text(estimate.value, digits)
    return f"{value} (95 %: {interval})" if interval else value


def percent_text(share: float) -> str:
    """Return a share in percent, with at most one decimal: ``6.3 %``, ``70 %``."""
    return f"{100.0 * share:.1f} %".replace(".0 %", " %")


def significant(findings: Sequence[Finding]) -> list[Finding]:
    """Return the findings whose p, adjusted where it is, is below ALPHA."""
    return [finding for finding in findings if finding.is_significant]


def verdict(finding: Finding, yes: str, no: str) -> str:
    """Return ``yes`` or ``no`` by the test, or why it was not done."""
    if finding.p is None:
        return finding.note
    return yes if finding.is_significant else no


ALPHA_TEXT = f"{ALPHA:g}"
