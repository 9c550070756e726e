"""The learning curve of several runs that differ in their seed, as a picture (PNG)."""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
import io
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from shared.telemetry.figures import COLOURS, GRID, INK, SOFT, STYLE

PICTURE_COLOURS = {INK: "#1c2128", SOFT: "#5d6673", GRID: "#d8dde3"}
"""A picture has no page whose scheme it could follow."""
LINES = ("#1c2128", "#7a4fa3", "#2a8f6d", "#b7791f", "#8b5e34", "#5d6673")


@dataclasses.dataclass(frozen=True)
class SeedCurve:
    """One run."""

    label: str
    x: Sequence[float]
    mean: Sequence[float]
    """Score a bout; NaN where the line is broken."""
    colour: int | None = None
    """Of several runs that belong together; each its own where there is none."""

    @staticmethod
    def joined(
        label: str, stages: Sequence[tuple[Sequence[float], Sequence[float]]]
    ) -> "SeedCurve":
        """Return the curve of a run from x and mean of each of its stages, broken between them."""
        x: list[float] = []
        mean: list[float] = []
        for stage_x, stage_mean in stages:
            x += [*stage_x, stage_x[-1]] if stage_x else []
            mean += [*stage_mean, float("nan")] if stage_mean else []
        return SeedCurve(label, x, mean)


@dataclasses.dataclass(frozen=True)
class Shade:
    """A stage behind the lines."""

    agent: str
    """Who learns."""
    label: str
    start: float
    end: float


def seed_curves(curves: Sequence[SeedCurve], shades: Sequence[Shade], x_label: str) -> bytes:
    """Return the antagonist's score over samples, one line a seed, stages shaded, as PNG."""
    style: Any = {
        key: PICTURE_COLOURS.get(value, value) if isinstance(value, str) else value
        for key, value in STYLE.items()
    } | {"figure.facecolor": "white", "savefig.facecolor": "white"}
    with mpl.rc_context(style):
        figure = Figure(figsize=(10, 4.2), layout="constrained", dpi=130)
        axes = figure.add_subplot()
        axes.axhline(0.0, color=PICTURE_COLOURS[SOFT], linewidth=0.8, linestyle=(0, (4, 3)))
        for shade in shades:
            colour = COLOURS.get(shade.agent, PICTURE_COLOURS[INK])
            axes.axvspan(shade.start, shade.end, color=colour, alpha=0.08, linewidth=0)
            axes.text(
                (shade.start + shade.end) / 2, 1.02, shade.label, color=colour, ha="center",
                va="bottom", fontsize=9.5, transform=axes.get_xaxis_transform(),
            )  # fmt: skip
        for k, curve in enumerate(curves):
            axes.plot(
                np.asarray(curve.x), np.asarray(curve.mean), linewidth=1.5, alpha=0.9,
                color=LINES[(k if curve.colour is None else curve.colour) % len(LINES)],
                label=curve.label or None,
            )  # fmt: skip
        if shades:
            axes.set_xlim(shades[0].start, max(shade.end for shade in shades))
        axes.set_xlabel(x_label)
        axes.set_ylabel("antagonist's score per bout")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value / 1e6:g}M"))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
        axes.grid(visible=False, axis="x")
        axes.legend(loc="best", ncols=min(3, max(1, len(curves))))
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", metadata={"Software": "Riposte"})
    return buffer.getvalue()
