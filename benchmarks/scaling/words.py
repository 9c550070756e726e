"""Figures and tables as Markdown."""

import math
from collections.abc import Iterable, Sequence


def number(value: float) -> str:
    """Return a figure with three digits that matter."""
    if math.isinf(value):
        return "-"
    if value == 0.0 or abs(value) >= 1000:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)
