"""The picture of how often hidden effects are named: by effect, and by how much each explains.

A PNG, for pages that show pictures and nothing else.
"""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
import io
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, PercentFormatter

from shared.telemetry.scaling_figures import INK, SOFT, STYLE

COLOURS = {"right": "#3f8f5a", "tie": "#a9d3b5", "no name": "#c9cfd6", "wrong": "#d9532c"}
"""Of what was said: the effect with its place, one of several, nothing, or something else."""
WORDS = {
    "right": "named, with its place",
    "tie": "one of several",
    "no name": "no name",
    "wrong": "another name or place",
}


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What was said where one effect was hidden, or nothing."""

    label: str
    counts: dict[str, int]
    """How often, by the keys of ``COLOURS``."""


@dataclasses.dataclass(frozen=True)
class Rate:
    """How often the right effect was named among those that explain about as much."""

    low: float
    """Share of what the base fit leaves, from which on."""
    high: float
    value: float
    interval: tuple[float, float]
    """95 %."""
    count: int


def naming(outcomes: Sequence[Outcome], rates: Sequence[Rate], goal: float) -> bytes:
    """Return the PNG.

    Args:
        outcomes: the one to be drawn at the top first.
        rates: from little to much.
        goal: for a rate.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(11, 0.235 * len(outcomes) + 1.3), layout="constrained", dpi=130)
        FigureCanvasAgg(figure)
        plots: Any = figure.subplots(1, 2, width_ratios=[1.35, 1.0])
        _outcomes(plots[0], outcomes)
        _rates(plots[1], rates, goal)
        out = io.BytesIO()
        figure.savefig(out, format="png", metadata={"Software": None})
        return out.getvalue()


def _outcomes(axes: Axes, outcomes: Sequence[Outcome]) -> None:
    rows = np.arange(len(outcomes))[::-1]
    begin = np.zeros(len(outcomes))
    for key, colour in COLOURS.items():
        counts = np.array([each.counts.get(key, 0) for each in outcomes], np.float64)
        axes.barh(rows, counts, 0.74, begin, color=colour, label=WORDS[key])
        begin += counts
    axes.set_yticks(rows, [each.label for each in outcomes], color=INK, fontsize=8.5)
    axes.set_ylim(-0.6, len(outcomes) - 0.4)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_xlabel("data sets with this one effect hidden")
    axes.set_title("What was said of each effect", pad=22)
    axes.grid(visible=False, axis="y")
    axes.legend(
        fontsize=8, ncols=len(COLOURS), loc="lower left", bbox_to_anchor=(0.0, 0.995),
        borderpad=0.2, handlelength=1.0, columnspacing=1.2,
    )  # fmt: skip


def _rates(axes: Axes, rates: Sequence[Rate], goal: float) -> None:
    at = np.arange(len(rates))
    axes.axhline(goal, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
    axes.text(-0.4, goal + 0.01, f"goal {goal:.0%}", fontsize=8.5, va="bottom")
    for x, rate in zip(at.tolist(), rates, strict=True):
        axes.plot([x, x], rate.interval, color=COLOURS["right"], linewidth=2.0, alpha=0.45)
        axes.plot([x], [rate.value], "o", color=COLOURS["right"], markersize=7)
        axes.text(x, -0.01, f"n = {rate.count}", fontsize=8, color=SOFT, ha="center", va="top")
    axes.set_xticks(at, [_range(rate) for rate in rates])
    axes.set_xlim(-0.5, len(rates) - 0.5)
    axes.set_ylim(-0.06, 1.02)
    axes.yaxis.set_major_formatter(PercentFormatter(1.0))
    axes.set_xlabel("of what the base fit leaves, the hidden effect takes off")
    axes.set_title("Named, by how much there is to explain", pad=22)
    axes.grid(visible=False, axis="x")


def _range(rate: Rate) -> str:
    if rate.low < 0.0:
        return f"under {rate.high:.0%}"
    return f"{100 * rate.low:.0f}-{rate.high:.0%}"
