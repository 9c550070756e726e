"""The figures of reports, as SVG text that is the same for the same data.

Drawn without a display and without pyplot's global state. Ink and grid are written as CSS
variables, so that a figure inlined in a page follows its light or dark scheme.
"""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
import io
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

FEW_POINTS = 12
"""A curve of at most this many points has them marked."""
COLOURS = {"antagonist": "#d9532c", "protagonist": "#3576c4"}
INK, SOFT, GRID = "#010203", "#040506", "#070809"
"""Stand-ins that ``_svg`` replaces by the page's variables."""
CSS = {
    INK: "var(--ink, #1c2128)",
    SOFT: "var(--soft, #5d6673)",
    GRID: "var(--grid, #d8dde3)",
    COLOURS["antagonist"]: f"var(--antagonist, {COLOURS['antagonist']})",
    COLOURS["protagonist"]: f"var(--protagonist, {COLOURS['protagonist']})",
}
STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 10,
    "svg.fonttype": "none",
    "svg.hashsalt": "riposte",
    "text.color": INK,
    "axes.edgecolor": GRID,
    "axes.labelcolor": SOFT,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.major.size": 0,
    "ytick.major.size": 0,
    "legend.frameon": False,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "savefig.facecolor": "none",
}


@dataclasses.dataclass(frozen=True)
class StageCurve:
    """Mean score per bout over one stage."""

    agent: str
    """Who learns."""
    label: str
    start: float
    """x where the stage begins and ends."""
    end: float
    x: Sequence[float]
    mean: Sequence[float]
    low: Sequence[float]
    high: Sequence[float]
    """95 % interval of the mean."""


@dataclasses.dataclass(frozen=True)
class Panel:
    """One small plot of training health: a line for each agent and stage."""

    title: str
    lines: Sequence[tuple[str, Sequence[float], Sequence[float]]]
    """Agent, x, y."""
    zero: bool = False
    """Begin the axis at 0."""


def learning_curve(curves: Sequence[StageCurve], x_label: str) -> str:
    """Return the paper's figure: the antagonist's mean game score, stages marked by who learns."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 4.2), layout="constrained")
        axes = figure.add_subplot()
        axes.axhline(0.0, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
        for curve in curves:
            colour = COLOURS.get(curve.agent, INK)
            axes.axvspan(curve.start, curve.end, color=colour, alpha=0.06, linewidth=0)
            axes.fill_between(curve.x, curve.low, curve.high, color=colour, alpha=0.22, linewidth=0)
            few = len(curve.x) <= FEW_POINTS
            axes.plot(
                curve.x, curve.mean, color=colour, linewidth=1.8, marker="o" if few else None,
                markersize=4,
            )  # fmt: skip
            if len(curve.x) == 1:
                axes.vlines(curve.x, curve.low, curve.high, color=colour, alpha=0.5)
            axes.text(
                (curve.start + curve.end) / 2,
                1.02,
                curve.label,
                color=colour,
                ha="center",
                va="bottom",
                fontsize=9.5,
                transform=axes.get_xaxis_transform(),
            )
        if curves:
            axes.set_xlim(curves[0].start, max(curve.end for curve in curves))
        axes.set_xlabel(x_label)
        axes.set_ylabel("antagonist's score per bout")
        axes.xaxis.set_major_formatter(FuncFormatter(_short_number))
        axes.yaxis.set_major_formatter(FuncFormatter(_thousands))
        axes.grid(visible=False, axis="x")
        return _svg(figure)


def training_panels(panels: Sequence[Panel], x_label: str, columns: int = 3) -> str:
    """Return small plots of how training went, one for each panel."""
    rows = -(-len(panels) // columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 2.25 * rows + 0.3), layout="constrained")
        for k, panel in enumerate(panels):
            axes = figure.add_subplot(rows, columns, k + 1)
            for agent, x, y in panel.lines:
                colour = COLOURS.get(agent, INK)
                axes.plot(x, y, color=colour, linewidth=1.1, alpha=0.9)
            axes.set_title(panel.title)
            axes.xaxis.set_major_locator(MaxNLocator(5))
            axes.yaxis.set_major_locator(MaxNLocator(4))
            axes.xaxis.set_major_formatter(FuncFormatter(_short_number))
            axes.yaxis.set_major_formatter(FuncFormatter(_short_number))
            if panel.zero:
                axes.set_ylim(bottom=0.0)
            if k + columns >= len(panels):
                axes.set_xlabel(x_label)
        return _svg(figure)


@dataclasses.dataclass(frozen=True)
class Segment:
    """A bone or a blade, from one point to another."""

    agent: str
    points: Sequence[Sequence[float]]
    """World positions (m), two or more."""
    blade: bool = False


def scene_drawing(
    segments: Sequence[Segment], target_centre: Sequence[float], target_radius: float
) -> str:
    """Return the scene seen from the side as lines, for machines that cannot render it."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 4.2), layout="constrained")
        axes = figure.add_subplot()
        angle = np.linspace(0.0, 2.0 * np.pi, 73)
        axes.fill(
            target_centre[0] + target_radius * np.cos(angle),
            target_centre[2] + target_radius * np.sin(angle),
            color="#e8b23a",
            alpha=0.35,
            linewidth=0,
        )
        for segment in segments:
            points = np.asarray(segment.points)
            axes.plot(
                points[:, 0],
                points[:, 2],
                color=COLOURS.get(segment.agent, INK),
                linewidth=5.0 if segment.blade else 2.2,
                marker=None if segment.blade else "o",
                markersize=4,
                solid_capstyle="round",
            )
        axes.set_aspect("equal")
        axes.set_ylim(bottom=0.0)
        axes.set_xlabel("along the line between the robots (m)")
        axes.set_ylabel("height (m)")
        return _svg(figure)


def _svg(figure: Figure) -> str:
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": "Riposte"})
    text = buffer.getvalue()
    for stand_in, variable in CSS.items():
        text = text.replace(stand_in, variable)
    return text


def _short_number(value: float, _position: int | None = None) -> str:
    for size, letter in ((1e6, "M"), (1e3, "k")):
        if abs(value) >= size:
            return f"{value / size:g}{letter}"
    return f"{value:g}"


def _thousands(value: float, _position: int | None = None) -> str:
    return f"{value:,.0f}".replace("-", "\N{MINUS SIGN}")
