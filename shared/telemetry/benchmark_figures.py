"""The picture of the benchmarks: how near the goals, and beside what people would pick instead.

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
from matplotlib.ticker import FuncFormatter, NullFormatter

from shared.telemetry.scaling_figures import INK, SOFT, STYLE

MET, MISSED, OURS, THEIRS, OLD = "#3f8f5a", "#d9532c", "#3576c4", "#b4bcc6", "#c9cfd6"


@dataclasses.dataclass(frozen=True)
class Goal:
    """One benchmark: how many times its goal is reached; over 1 is better than asked for."""

    label: str
    value: float
    low: float
    """Of its rounds or its interval; the value itself where it has none."""
    high: float
    before: Sequence[float]
    """What earlier rows had."""
    text: str
    """The figure as it is, and its goal."""

    @property
    def is_met(self) -> bool:
        """Return whether it is reached."""
        return self.value >= 1.0


@dataclasses.dataclass(frozen=True)
class Bar:
    """One of those that did the same work."""

    label: str
    value: float
    low: float
    high: float
    is_ours: bool


@dataclasses.dataclass(frozen=True)
class Contest:
    """The same work by us and by others."""

    title: str
    unit: str
    is_more_better: bool
    bars: Sequence[Bar]


def benchmarks(goals: Sequence[Goal], contests: Sequence[Contest]) -> bytes:
    """Return the PNG: goals above, contests below."""
    with mpl.rc_context(STYLE):
        tall = 0.34 * len(goals) + 1.2
        most = max((len(contest.bars) for contest in contests), default=0)
        low = 0.34 * most + 0.9 if contests else 0.0
        figure = Figure(figsize=(11, tall + low), layout="constrained", dpi=130)
        FigureCanvasAgg(figure)
        if contests:
            halves: Any = figure.subfigures(2, 1, height_ratios=[tall, low])
            above, below = halves
            plots = np.ravel(below.subplots(1, len(contests)))
            for axes, contest in zip(plots, contests, strict=True):
                _contest(axes, contest)
        else:
            above = figure
        _goals(above.add_subplot(), goals)
        out = io.BytesIO()
        figure.savefig(out, format="png", metadata={"Software": None})
        return out.getvalue()


def _goals(axes: Axes, goals: Sequence[Goal]) -> None:
    rows = np.arange(len(goals))[::-1]
    axes.axvline(1.0, color=INK, linewidth=0.9, linestyle=(0, (4, 3)))
    for row, goal in zip(rows.tolist(), goals, strict=True):
        colour = MET if goal.is_met else MISSED
        axes.plot(goal.before, [row] * len(goal.before), "o", color=OLD, markersize=4)
        axes.plot([goal.low, goal.high], [row, row], color=colour, linewidth=2.0, alpha=0.45)
        axes.plot([goal.value], [row], "o", color=colour, markersize=7)
        axes.text(
            1.01, row, goal.text, color=INK if goal.is_met else MISSED, fontsize=8.5, va="center",
            transform=axes.get_yaxis_transform(),
        )  # fmt: skip
    axes.set_yticks(rows, [goal.label for goal in goals], color=INK)
    axes.set_ylim(-0.6, len(goals) - 0.4)
    axes.set_xscale("log")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xticks([0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0])
    axes.set_xlabel("times the goal: right of the line it is reached (pale: earlier rows)")
    axes.set_title("Goals, newest row of each benchmark")
    axes.grid(visible=False, axis="y")


def _contest(axes: Axes, contest: Contest) -> None:
    rows = np.arange(len(contest.bars))[::-1]
    largest = max(max(bar.value, bar.high) for bar in contest.bars)
    for row, bar in zip(rows.tolist(), contest.bars, strict=True):
        axes.barh(row, bar.value, height=0.62, color=OURS if bar.is_ours else THEIRS)
        if bar.high > bar.low:
            axes.plot([bar.low, bar.high], [row, row], color=SOFT, linewidth=1.4)
        edge = max(bar.value, bar.high)
        axes.text(edge + 0.02 * largest, row, _text(bar.value), va="center", fontsize=8.5)
    axes.set_yticks(rows, [bar.label for bar in contest.bars], color=INK, fontsize=8.5)
    axes.set_xlim(0.0, 1.2 * largest)
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: _text(value)))
    axes.locator_params(axis="x", nbins=4)
    axes.set_xlabel(f"{contest.unit}, {'more' if contest.is_more_better else 'less'} is better")
    axes.set_title(contest.title, fontsize=9.5)
    axes.grid(visible=False, axis="y")


def _text(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
