"""A tournament as a Rerun recording: payoff tensor, bars of the ratings, standings in words."""

# pyright: basic
# (rerun's types are partial)

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from shared.errors import RiposteError
from shared.telemetry.recording import APPLICATION, PAYOFF, RATINGS, STANDINGS
from shared.telemetry.rrd import RecordingFile

Floats = NDArray[np.float64]
COLOURS = {"antagonist": (217, 83, 44), "protagonist": (53, 118, 196)}


@dataclasses.dataclass(frozen=True)
class Bars:
    """The ratings of one side."""

    agent: str
    players: Sequence[tuple[str, float, float, float]]
    """Name, Elo, low and high end of its 95 % interval; strongest first."""


def write_recording(
    path: Path,
    payoff: Floats,
    antagonists: Sequence[str],
    protagonists: Sequence[str],
    ratings: Sequence[Bars],
) -> None:
    """Write the recording, whole or not at all.

    Args:
        path: of the file.
        payoff: float64[A, P], mean points a bout; NaN: not played.
        antagonists: names of the rows.
        protagonists: names of the columns.
        ratings: of each side.

    Raises:
        RiposteError: it cannot be written.
    """
    stream = rr.RecordingStream(APPLICATION, recording_id=f"tournament-{path.parent.parent.name}")
    memory = stream.binary_stream()
    stream.send_blueprint(_layout(ratings))
    most = float(np.nanmax(np.abs(payoff), initial=1.0))
    tensor = rr.Tensor(
        np.nan_to_num(payoff).astype(np.float32),
        dim_names=["antagonist", "protagonist"],
        value_range=[-most, most],
    )
    stream.log(PAYOFF, tensor, static=True)
    for bars in ratings:
        values = np.array([elo for _, elo, _, _ in bars.players], np.float32)
        chart = rr.BarChart(values, color=COLOURS[bars.agent])
        stream.log(f"{RATINGS}/{bars.agent}", chart, static=True)
    words = rr.TextDocument(
        standings_text(payoff, antagonists, protagonists, ratings),
        media_type=rr.MediaType.MARKDOWN,
    )
    stream.log(STANDINGS, words, static=True)
    content = memory.read(flush=True) or b""
    stream.disconnect()
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        temporary.unlink(missing_ok=True)
        file = RecordingFile(temporary)
        try:
            file.write(content)
        finally:
            file.close()
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise RiposteError(f"{path} cannot be written ({error.strerror})") from error


def standings_text(
    payoff: Floats,
    antagonists: Sequence[str],
    protagonists: Sequence[str],
    ratings: Sequence[Bars],
) -> str:
    """Return payoff and ratings as Markdown."""
    lines = ["# Tournament", "", "Mean points a bout, antagonists (rows) v protagonists.", ""]
    lines += ["| | " + " | ".join(protagonists) + " |", "|---" * (len(protagonists) + 1) + "|"]
    for name, row in zip(antagonists, payoff, strict=True):
        cells = ["-" if np.isnan(value) else f"{value:+,.0f}" for value in row]
        lines.append(f"| **{name}** | " + " | ".join(cells) + " |")
    for bars in ratings:
        lines += ["", f"## {bars.agent.capitalize()}s", "", "| | Elo | 95 % |", "|---|---|---|"]
        lines += [
            f"| {k}. {name} | {elo:+.0f} | {low:+.0f} to {high:+.0f} |"
            for k, (name, elo, low, high) in enumerate(bars.players, 1)
        ]
    return "\n".join(lines)


def _layout(ratings: Sequence[Bars]) -> rrb.Blueprint:
    charts = [
        rrb.BarChartView(origin=f"{RATINGS}/{bars.agent}", name=f"Elo of the {bars.agent}s")
        for bars in ratings
    ]
    payoff = rrb.TensorView(origin=PAYOFF, name="Payoff: antagonists v protagonists")
    words = rrb.TextDocumentView(origin=STANDINGS, name="Standings")
    return rrb.Blueprint(
        rrb.Horizontal(words, rrb.Vertical(payoff, *charts, row_shares=[2, 1, 1])),
        collapse_panels=True,
        auto_views=False,
    )
