"""The figure of the scaling model: what a site does with more and more actors, as a PNG."""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
import io
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

INK, SOFT, GRID = "#1c2128", "#5d6673", "#d8dde3"
COLOURS = ("#d9532c", "#3576c4", "#3f8f5a", "#8a5fb0", "#b08a2e")
STYLE: Any = {
    "font.size": 10, "text.color": INK, "axes.edgecolor": GRID, "axes.labelcolor": SOFT,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "axes.axisbelow": True, "axes.titlesize": 10, "axes.titlelocation": "left",
    "axes.titleweight": "bold", "grid.color": GRID, "grid.linewidth": 0.6, "xtick.color": SOFT,
    "ytick.color": SOFT, "legend.frameon": False, "figure.facecolor": "white",
}  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Curve:
    """One site."""

    label: str
    actors: Sequence[int]
    values: Sequence[float]


def scaling(sites: Sequence[Curve], uses: Sequence[Curve], measured: Sequence[Curve]) -> bytes:
    """Return the PNG.

    Args:
        sites: samples a second by number of actors, one curve a site.
        uses: share of a resource's capacity that stands on it whatever is learned, by number of
            actors.
        measured: points to draw over ``uses``, with the labels of their curves.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 4.2), layout="constrained", dpi=130)
        FigureCanvasAgg(figure)
        left, right = figure.subplots(1, 2)
        for colour, curve in zip(COLOURS, sites, strict=False):
            left.plot(curve.actors, curve.values, color=colour, linewidth=1.8, label=curve.label)
        left.set_ylim(1e4, 1e6)
        left.set_ylabel("samples learned from, a second")
        left.set_title("Predicted rate")
        by_label = {curve.label: curve for curve in measured}
        for colour, curve in zip(COLOURS, uses, strict=False):
            right.plot(curve.actors, curve.values, color=colour, linewidth=1.8, label=curve.label)
            if (points := by_label.get(curve.label)) is not None:
                right.plot(points.actors, points.values, "o", color=colour, markersize=5)
        right.axhline(1.0, color=INK, linewidth=0.8, linestyle=(0, (4, 3)))
        right.set_ylim(1e-4, 30.0)
        right.set_ylabel("share of the resource")
        right.set_title("Taken by actors alone, whatever is learned")
        for axes in (left, right):
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlabel("actors")
            axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
            axes.legend(fontsize=8, loc="best")
            axes.yaxis.set_minor_formatter(NullFormatter())
            axes.xaxis.set_minor_formatter(NullFormatter())
        left.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
        right.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g} %"))
        out = io.BytesIO()
        figure.savefig(out, format="png", metadata={"Software": None})
        return out.getvalue()
