"""Figures of a tournament, as SVG text: who scores what against whom, and who is how strong."""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
from collections.abc import Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from shared.telemetry.figures import COLOURS, INK, SOFT, STYLE, _svg, _thousands

Floats = NDArray[np.float64]
CELL = (1.02, 0.62)
"""Width and height of a pairing (inches)."""
FAINT, STRONG = 0.08, 0.62
"""Opacity of a score of 0 and of the largest one."""
SMALLEST_WIDTH = 6.0
INTERVALS_UP_TO = 12
"""Columns up to which there is room to write the intervals."""


@dataclasses.dataclass(frozen=True)
class Strength:
    """One player's rating with its 95 % interval."""

    label: str
    value: float
    low: float
    high: float


def heat_map(
    antagonists: Sequence[str],
    protagonists: Sequence[str],
    mean: Floats,
    low: Floats,
    high: Floats,
    camping_share: Floats,
) -> str:
    """Return the payoff matrix, orange where the antagonist scores and blue where it pays.

    Args:
        antagonists: names of the A rows.
        protagonists: names of the P columns.
        mean: float64[A, P], points a bout; NaN: not played.
        low: float64[A, P], 95 % interval.
        high: float64[A, P].
        camping_share: float64[A, P], of the points given and taken.
    """
    rows, columns = mean.shape
    most = float(np.nanmax(np.abs(mean), initial=1.0))
    width = max(SMALLEST_WIDTH, CELL[0] * columns + 2.0)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width, CELL[1] * rows + 1.1), layout="constrained")
        axes = figure.add_subplot()
        for i in range(rows):
            for j in range(columns):
                if not np.isnan(mean[i, j]):
                    _cell(axes, j, i, mean[i, j], low[i, j], high[i, j], most, columns)
                    if camping_share[i, j] >= 0.005:
                        share = f"camping {100 * camping_share[i, j]:.0f} %"
                        axes.text(j, i + 0.38, share, color=SOFT, fontsize=6, ha="center",
                                  va="center")  # fmt: skip
        axes.set_xlim(-0.5, columns - 0.5)
        axes.set_ylim(rows - 0.5, -0.5)
        axes.set_xticks(range(columns), [_wrapped(name) for name in protagonists], fontsize=8)
        axes.set_yticks(range(rows), antagonists, fontsize=8)
        axes.xaxis.tick_top()
        axes.xaxis.set_label_position("top")
        axes.set_xlabel("protagonist", color=COLOURS["protagonist"])
        axes.set_ylabel("antagonist", color=COLOURS["antagonist"])
        axes.grid(visible=False)
        for side in ("left", "bottom"):
            axes.spines[side].set_visible(False)
        return _svg(figure)


def strengths(antagonists: Sequence[Strength], protagonists: Sequence[Strength]) -> str:
    """Return the ratings of both pools, strongest on top, with their intervals."""
    rows = max(len(antagonists), len(protagonists))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 0.3 * rows + 1.0), layout="constrained")
        found = figure.subplots(1, 2, sharex=True)
        for axes, agent, pool in zip(
            found, ("antagonist", "protagonist"), (antagonists, protagonists), strict=True
        ):
            colour = COLOURS[agent]
            places = range(len(pool))
            axes.axvline(0.0, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
            axes.hlines(
                places, [one.low for one in pool], [one.high for one in pool], color=colour,
                linewidth=2.2, alpha=0.45,
            )  # fmt: skip
            axes.plot([one.value for one in pool], places, "o", color=colour, markersize=5)
            axes.set_yticks(places, [one.label for one in pool], fontsize=8, color=INK)
            axes.set_ylim(rows - 0.5, -0.5)
            axes.set_xlabel("Elo, 95 % interval; 0: mean of the pool")
            axes.set_title(f"{agent}s", color=colour)
            axes.grid(visible=False, axis="y")
        return _svg(figure)


def _cell(
    axes: Axes, x: int, y: int, mean: float, low: float, high: float, most: float,
    columns: int,
) -> None:  # fmt: skip
    colour = COLOURS["antagonist" if mean >= 0.0 else "protagonist"]
    alpha = FAINT + (STRONG - FAINT) * min(1.0, abs(mean) / most)
    box = Rectangle((x - 0.48, y - 0.46), 0.96, 0.92, color=colour, alpha=alpha, linewidth=0)
    axes.add_patch(box)
    axes.text(
        x, y - 0.12, _signed(mean), color=INK, fontsize=10, fontweight="bold", ha="center",
        va="center",
    )  # fmt: skip
    if columns <= INTERVALS_UP_TO:
        reach = f"{_signed(low)} to {_signed(high)}"
        axes.text(x, y + 0.17, reach, color=INK, fontsize=6.5, ha="center", va="center")


def _signed(value: float) -> str:
    text = _thousands(round(value))
    return f"+{text}" if round(value) > 0 else text


def _wrapped(name: str) -> str:
    """Return a name on at most two lines."""
    first, _, rest = name.partition(" ")
    return f"{first}\n{rest}" if rest else name
