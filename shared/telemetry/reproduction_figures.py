"""The figures of the reproduction report: both phases' scores, and which opponents were drawn."""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from shared.telemetry.figures import (
    COLOURS,
    FEW_POINTS,
    SOFT,
    STYLE,
    _short_number,
    _svg,
    _thousands,
)

COLUMNS = 3


@dataclasses.dataclass(frozen=True)
class Line:
    """The antagonist's score while one agent learned."""

    agent: str
    x: Sequence[float]
    """Samples both agents had learned from, counted from the beginning of phase one (of the round
    in a round)."""
    mean: Sequence[float]


@dataclasses.dataclass(frozen=True)
class RoundPanel:
    """One round of phase two."""

    title: str
    lines: Sequence[Line]


@dataclasses.dataclass(frozen=True)
class DrawPanel:
    """The draws of one round: who was drawn when."""

    title: str
    points: Sequence[tuple[str, int, int]]
    """Who learned, iteration from 1, place of the opponent in the history: 0 is the warm start."""


def both_phases(
    phase_one: Sequence[Line], ends: Sequence[float], rounds: Sequence[RoundPanel]
) -> str:
    """Return the paper's learning figure for every round: phase one, then the round.

    Args:
        phase_one: one line a stage.
        ends: where its stages end, in samples.
        rounds: with samples counted from the round's beginning.
    """
    rows = -(-max(1, len(rounds)) // COLUMNS)
    lowest, highest = _limits([*phase_one, *(line for panel in rounds for line in panel.lines)])
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 2.9 * rows + 0.3), layout="constrained")
        start = ends[-1] if ends else 0.0
        for k, panel in enumerate(rounds):
            axes = figure.add_subplot(rows, COLUMNS, k + 1)
            axes.axhline(0.0, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
            for end in ends:
                axes.axvline(end, color=SOFT, linewidth=0.6, alpha=0.6)
            for line in phase_one:
                few = len(line.x) <= FEW_POINTS
                axes.plot(
                    line.x, line.mean, color=COLOURS[line.agent], linewidth=1.3,
                    marker="o" if few else None, markersize=3,
                )  # fmt: skip
            for line in panel.lines:
                x = start + np.asarray(line.x)
                axes.plot(
                    x, line.mean, color=COLOURS[line.agent], linewidth=0, marker="o", markersize=2.2
                )
            axes.set_title(panel.title)
            axes.set_ylim(lowest, highest)
            axes.xaxis.set_major_locator(MaxNLocator(5))
            axes.xaxis.set_major_formatter(FuncFormatter(_short_number))
            axes.yaxis.set_major_formatter(FuncFormatter(_thousands))
            axes.grid(visible=False, axis="x")
            if k % COLUMNS == 0:
                axes.set_ylabel("antagonist's score a bout")
            if k + COLUMNS >= len(rounds):
                axes.set_xlabel("samples")
        return _svg(figure)


def drawn_opponents(panels: Sequence[DrawPanel]) -> str:
    """Return which version was drawn in each iteration, a small plot for each round."""
    rows = -(-max(1, len(panels)) // COLUMNS)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 2.6 * rows + 0.3), layout="constrained")
        for k, panel in enumerate(panels):
            axes = figure.add_subplot(rows, COLUMNS, k + 1)
            last = max((iteration for _, iteration, _ in panel.points), default=1)
            axes.plot([1, last], [0, last - 1], color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
            for agent, colour in COLOURS.items():
                x = [iteration for who, iteration, _ in panel.points if who == agent]
                y = [place for who, _, place in panel.points if who == agent]
                axes.plot(x, y, color=colour, linewidth=0, marker="o", markersize=3, alpha=0.85)
            axes.set_title(panel.title)
            axes.xaxis.set_major_locator(MaxNLocator(5, integer=True))
            axes.yaxis.set_major_locator(MaxNLocator(5, integer=True))
            if k % COLUMNS == 0:
                axes.set_ylabel("version drawn")
            if k + COLUMNS >= len(panels):
                axes.set_xlabel("iteration of the round")
        return _svg(figure)


def _limits(lines: Sequence[Line]) -> tuple[float, float]:
    """Return one score axis for all panels, with a little room."""
    values = [value for line in lines for value in line.mean]
    low, high = min(values, default=-1.0), max(values, default=1.0)
    room = 0.05 * max(high - low, 1.0)
    return low - room, high + room
