"""The figure of a study that compares protagonists: their antagonists' points, as a PNG."""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
import io
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

INK, SOFT, GRID = "#1c2128", "#5d6673", "#d8dde3"
COLOURS = ("#8b95a3", "#3576c4", "#d9532c")
STYLE: Any = {
    "font.size": 10, "text.color": INK, "axes.edgecolor": GRID, "axes.labelcolor": SOFT,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "axes.axisbelow": True, "grid.color": GRID, "grid.linewidth": 0.6, "xtick.color": SOFT,
    "ytick.color": SOFT, "legend.frameon": False, "figure.facecolor": "white",
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Group:
    """One kind of protagonist."""

    label: str
    means: Sequence[float]
    """By antagonist."""
    lows: Sequence[float]
    highs: Sequence[float]
    seeds: Sequence[Sequence[float]]
    """By antagonist, the mean of each seed."""


def points_against(antagonists: Sequence[str], groups: Sequence[Group]) -> bytes:
    """Return the PNG: bars with intervals, and a dot for each seed."""
    width = 0.8 / len(groups)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(9, 3.8), layout="constrained", dpi=130)
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        for index, (colour, group) in enumerate(zip(COLOURS, groups, strict=True)):
            at = [k + (index - 0.5 * (len(groups) - 1)) * width for k in range(len(antagonists))]
            axes.bar(at, group.means, 0.9 * width, color=colour, alpha=0.75, label=group.label)
            axes.vlines(at, group.lows, group.highs, color=INK, linewidth=1.2)
            for place, values in zip(at, group.seeds, strict=True):
                axes.plot([place] * len(values), values, "o", color=INK, markersize=2.5)
        axes.set_xticks(range(len(antagonists)), list(antagonists))
        axes.set_ylabel("antagonist's points a bout (fewer is better)")
        axes.legend(fontsize=9)
        out = io.BytesIO()
        figure.savefig(out, format="png", metadata={"Software": None})
        return out.getvalue()
