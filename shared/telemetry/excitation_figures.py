"""The picture of a recording programme: what is commanded, and how well effects will be seen."""

# pyright: basic
# (matplotlib's types are partial)

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter
from numpy.typing import NDArray

_STYLE: Any = {
    "font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
    "axes.axisbelow": True, "grid.color": "#e3e6ea", "axes.titlelocation": "left",
    "axes.titleweight": "bold", "legend.frameon": False,
}  # fmt: skip
_SEEN, _UNSEEN, _SOFT = "#3576c4", "#d9532c", "#5d6673"
_LEAST = 0.1
"""Smallest ratio that the axis shows."""


@dataclass(frozen=True)
class Stretch:
    """One recording."""

    name: str
    at: NDArray[np.float64]
    """float64[C] (s)."""
    command: NDArray[np.float64]
    """float64[C, U]."""
    is_held_out: bool


@dataclass(frozen=True)
class Bar:
    """How well an effect is seen."""

    name: str
    ratios: Sequence[float]
    """Of each place: the size looked at by that from which on it is named (1)."""
    is_visible: bool


def programme_picture(
    stretches: Sequence[Stretch], columns: Sequence[str], label: str, bars: Sequence[Bar]
) -> bytes:
    """Return a PNG.

    Args:
        stretches: the recordings in order; they are drawn one after the other.
        columns: names of the commands' columns that are drawn, from the first.
        label: of the commands, with their unit.
        bars: the effects.
    """
    with mpl.rc_context(_STYLE):
        height = 3.4 + 0.19 * len(bars)
        figure = Figure(figsize=(10, height), layout="constrained")
        over, under = figure.subplots(2, 1, height_ratios=(3.0, 0.4 + 0.19 * len(bars)))
        begin = 0.0
        for stretch in stretches:
            for index, name in enumerate(columns):
                over.plot(
                    begin + stretch.at, stretch.command[:, index], color=f"C{index}",
                    linewidth=0.9, label=name if begin == 0.0 else None,
                )  # fmt: skip
            end = begin + float(stretch.at[-1])
            over.axvspan(begin, end, color=_SOFT, alpha=0.12 if stretch.is_held_out else 0.0)
            over.text(
                begin, 1.01, stretch.name.replace("_", " "), fontsize=7.5, color=_SOFT,
                rotation=20, transform=over.get_xaxis_transform(),
            )  # fmt: skip
            over.axvline(end, color=_SOFT, linewidth=0.5)
            begin = end
        over.set_xlim(0.0, begin)
        over.set_xlabel("time (s), recordings one after the other; held-out ones shaded")
        over.set_ylabel(label)
        over.legend(ncols=len(columns), loc="lower right", fontsize=7.5)
        for row, bar in enumerate(bars):
            ratios = np.maximum(np.asarray(bar.ratios, np.float64), _LEAST)
            colour = _SEEN if bar.is_visible else _UNSEEN
            under.plot([ratios.min(), ratios.max()], [row, row], color=colour, linewidth=2.5)
            under.plot(ratios, np.full(len(ratios), row), "o", color=colour, markersize=3.5)
        under.axvline(1.0, color=_UNSEEN, linewidth=0.9, linestyle=(0, (4, 3)))
        under.set_xscale("log")
        under.xaxis.set_major_formatter(FuncFormatter(_plain))
        under.xaxis.set_minor_formatter(NullFormatter())
        under.set_yticks(range(len(bars)), [bar.name.replace("_", " ") for bar in bars])
        under.set_ylim(len(bars) - 0.4, -0.6)
        under.set_xlabel(
            "a size that matters, over the smallest that would be named; a dot for each place"
        )
        data = io.BytesIO()
        figure.savefig(data, format="png", dpi=110, metadata={"Software": None})
        return data.getvalue()


def _plain(value: float, _position: int | None = None) -> str:
    return f"{value:g}"
