"""The figures of styles: features with their spread (the paper's figure), and components in pairs.

The same conventions as ``shared.telemetry.figures``: SVG text, the same for the same data, that
follows the light or dark scheme of the page it is put into.
"""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
import itertools
from collections.abc import Sequence
from typing import Literal

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from shared.telemetry.figures import SOFT, STYLE, _svg

Floats = NDArray[np.float64]
Part = Literal["selected", "warm_start", "library"]
SELECTED_COLOURS = ("#c2711c", "#2a8f6d", "#8257b5")
"""Readable on white and on near-black; neither side's colour, for these are all one side's."""
MOST_DOTS = 150
"""Bouts drawn of one policy."""


@dataclasses.dataclass(frozen=True)
class StyleOf:
    """One policy in the figures."""

    label: str
    part: Part
    means: Sequence[float]
    """Of each feature."""
    spreads: Sequence[float]
    """Standard deviation of each over the bouts."""
    components: Floats
    """float64[B, k], its bouts in component space."""


def feature_panels(titles: Sequence[str], policies: Sequence[StyleOf]) -> str:
    """Return the paper's figure of styles: each feature's mean and standard deviation a policy.

    Args:
        titles: of the features, with their units.
        policies: in the order they are drawn.
    """
    columns = 4
    rows = -(-len(titles) // columns)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 2.4 * rows + 0.5), layout="constrained")
        for k, title in enumerate(titles):
            axes = figure.add_subplot(rows, columns, k + 1)
            for place, (policy, colour) in enumerate(_coloured(policies)):
                axes.errorbar(
                    place, policy.means[k], yerr=policy.spreads[k], color=colour, fmt="o",
                    markersize=6, elinewidth=2.0, capsize=4, capthick=1.6,
                    label=policy.label if k == 0 else None,
                )  # fmt: skip
            axes.set_title(title)
            axes.set_xlim(-0.7, len(policies) - 0.3)
            axes.set_xticks([])
            axes.yaxis.set_major_locator(MaxNLocator(4))
            axes.grid(visible=False, axis="x")
        if policies:
            figure.legend(loc="outside upper left", ncols=min(5, len(policies)))
        return _svg(figure)


def component_panels(policies: Sequence[StyleOf], shares: Sequence[float]) -> str:
    """Return each pair of components: bouts, means, and one standard deviation about them.

    Args:
        policies: all of them; those of the library that were not selected are drawn in grey.
        shares: of the variance, along each component.
    """
    pairs = list(itertools.combinations(range(len(shares)), 2))
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 3.9), layout="constrained")
        for number, (x, y) in enumerate(pairs):
            axes = figure.add_subplot(1, len(pairs), number + 1)
            for policy, colour in sorted(_coloured(policies), key=_selected_on_top):
                label = policy.label if number == 0 and policy.part != "library" else None
                _draw(axes, policy, colour, (x, y), label)
            axes.set_xlabel(f"component {x + 1} ({shares[x]:.0%})")
            axes.set_ylabel(f"component {y + 1} ({shares[y]:.0%})")
            axes.xaxis.set_major_locator(MaxNLocator(5))
            axes.yaxis.set_major_locator(MaxNLocator(5))
        if policies:
            figure.legend(loc="outside upper left", ncols=5)
        return _svg(figure)


def _draw(
    axes: Axes, policy: StyleOf, colour: str, plane: tuple[int, int], label: str | None
) -> None:
    points = policy.components[:, list(plane)]
    mean = points.mean(axis=0)
    is_grey = policy.part == "library"
    step = max(1, -(-len(points) // MOST_DOTS))
    if not is_grey:
        axes.plot(
            points[::step, 0], points[::step, 1], ".", color=colour, markersize=3, alpha=0.25,
            markeredgewidth=0,
        )  # fmt: skip
    axes.add_patch(_ellipse(points, mean, colour, 0.6 if is_grey else 1.8))
    axes.plot(
        *mean, "o", color=colour, markersize=4 if is_grey else 8, label=label,
        markerfacecolor="none" if policy.part == "warm_start" else colour, markeredgewidth=2,
    )  # fmt: skip
    if is_grey:
        axes.annotate(
            policy.label, mean, color=SOFT, fontsize=8, xytext=(4, 3), textcoords="offset points"
        )


def _ellipse(points: Floats, mean: Floats, colour: str, width: float) -> Ellipse:
    """Return the ellipse one standard deviation about the mean, along its own axes."""
    values, vectors = np.linalg.eigh(np.cov(points.T))
    across, along = 2.0 * np.sqrt(np.maximum(values, 0.0))
    angle = np.degrees(np.arctan2(vectors[1, 1], vectors[0, 1]))
    return Ellipse(
        (float(mean[0]), float(mean[1])), along, across, angle=float(angle), edgecolor=colour,
        facecolor="none", linewidth=width,
    )  # fmt: skip


def _coloured(policies: Sequence[StyleOf]) -> list[tuple[StyleOf, str]]:
    colours = iter(itertools.cycle(SELECTED_COLOURS))
    return [(policy, next(colours) if policy.part == "selected" else SOFT) for policy in policies]


def _selected_on_top(entry: tuple[StyleOf, str]) -> int:
    return ("library", "warm_start", "selected").index(entry[0].part)
