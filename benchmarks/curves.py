"""Learning curves before and after a change, overlaid: is what is learned still the same?

Say ``python -m benchmarks.learning static --seeds 3 --write`` in a checkout of each commit, then
``python -m benchmarks.curves BEFORE AFTER`` with both files ``benchmarks/learning.json``. Runs are
paired by seed; a difference has a 95 % t-interval over the seeds.
"""

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.harness import ROOT
from benchmarks.seeds import t_interval, text
from shared.errors import ConfigError, RiposteError
from shared.telemetry.seed_curves import SeedCurve, seed_curves

FIGURE = ROOT / "docs" / "images" / "learning-before-after.png"
WHAT = "static"
PARTS = 4
"""Into which a curve is cut, for the table."""


def main(argv: Sequence[str] | None = None) -> int:
    """Draw and print; return 1 where an interval of the difference leaves nought out."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.curves", description=__doc__)
    parser.add_argument("before", type=Path, metavar="BEFORE", help="a learning.json")
    parser.add_argument("after", type=Path, metavar="AFTER", help="a learning.json")
    parser.add_argument("--out", type=Path, default=FIGURE, metavar="PNG", help="(%(default)s)")
    found = parser.parse_args(argv)
    try:
        before, after = (runs_of(path) for path in (found.before, found.after))
        lines, is_same = compared(before, after)
    except RiposteError as error:
        print(f"curves: {error}", file=sys.stderr)
        return 2
    found.out.parent.mkdir(parents=True, exist_ok=True)
    found.out.write_bytes(picture(before, after))
    print("\n".join([*lines, "", str(found.out)]))
    return 0 if is_same else 1


def runs_of(path: Path) -> list[dict[str, Any]]:
    """Return the runs against a player that holds still, one a seed.

    Raises:
        ConfigError: the file has none.
    """
    try:
        runs = json.loads(path.read_text(encoding="utf-8"))[WHAT]["runs"]
    except (OSError, ValueError, KeyError) as error:
        raise ConfigError(
            f"{path} has no runs: say `python -m benchmarks.learning {WHAT} --write` there"
        ) from error
    return sorted(runs, key=lambda run: run["seed"])


def compared(
    before: Sequence[dict[str, Any]], after: Sequence[dict[str, Any]]
) -> tuple[list[str], bool]:
    """Return a Markdown table of both, and whether no interval of a difference leaves nought out.

    Raises:
        ConfigError: the runs are of other seeds, or of one only.
    """
    seeds = [run["seed"] for run in before]
    if seeds != [run["seed"] for run in after] or len(seeds) < 2:
        raise ConfigError(
            f"runs of the seeds {seeds} and {[run['seed'] for run in after]}: the same ones, two "
            "at least, can be compared"
        )
    lines = ["| | before | after | after - before |", "|---|---|---|---|"]
    is_same = True
    for name, form, value in _figures():
        one, other = ([value(run) for run in runs] for runs in (before, after))
        change = t_interval([b - a for a, b in zip(one, other, strict=True)])
        is_same &= change["low"] <= 0.0 <= change["high"]
        cells = [text(found, form) for found in (t_interval(one), t_interval(other), change)]
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return lines, is_same


def _figures() -> list[tuple[str, str, Callable[[dict[str, Any]], float]]]:
    """Return name, form and function of each figure of a run."""
    return [
        *(
            (f"score in quarter {part + 1} of the curve", ",.0f", partial(_mean_score, part))
            for part in range(PARTS)
        ),
        ("share of the steps in the target, at the end", ".3f", itemgetter("in_target_share")),
        ("score, at the end", ",.0f", itemgetter("score")),
    ]


def _mean_score(part: int, run: dict[str, Any]) -> float:
    """Return the mean score of the bouts that ended within a part of a curve.

    A curve begins where the first bout from start to end has ended.
    """
    samples = np.array([point["samples"] for point in run["curve"]], np.float64)
    scores = np.array([point["score"] for point in run["curve"]])
    places = (samples - samples[0]) / (samples[-1] - samples[0]) * PARTS
    return float(scores[np.minimum(places.astype(int), PARTS - 1) == part].mean())


def picture(before: Sequence[dict[str, Any]], after: Sequence[dict[str, Any]]) -> bytes:
    """Return every curve as a PNG, the lines of each side in one colour."""
    curves = [
        SeedCurve(
            f"{name}, {len(runs)} seeds" if not number else "",
            [point["samples"] for point in run["curve"]],
            [point["score"] for point in run["curve"]],
            side,
        )
        for side, (name, runs) in enumerate((("before", before), ("after", after)))
        for number, run in enumerate(runs)
    ]
    return seed_curves(curves, [], "samples")


if __name__ == "__main__":
    sys.exit(main())
