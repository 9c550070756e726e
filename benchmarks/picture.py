"""Draws the table of results: ``python -m benchmarks.picture``; `--write` of a benchmark does, too.

Above, how many times each benchmark's newest row reaches its goal; below, the same work by us and
by what people would pick instead, where a row has measured both.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.harness import ROOT
from benchmarks.rows import Figure, Row, newest, rows_of
from services.jobs.bench import PICTURE, RESULTS
from services.jobs.bench import figure as number
from shared.errors import RiposteError
from shared.telemetry.benchmark_figures import Bar, Contest, Goal, benchmarks

TABLE = ROOT / "benchmarks" / RESULTS
_OURS = "Riposte"


def main(argv: Sequence[str] | None = None) -> int:
    """Draw the picture; return 2 where the table cannot be read."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.picture", description=__doc__)
    parser.add_argument("--table", type=Path, default=TABLE, metavar="MD", help="(%(default)s)")
    parser.add_argument(
        "--out", type=Path, default=ROOT / PICTURE, metavar="PNG", help="(%(default)s)"
    )
    found = parser.parse_args(argv)
    try:
        draw(found.table, found.out)
    except (OSError, RiposteError) as error:
        print(f"picture: {error}", file=sys.stderr)
        return 2
    print(found.out)
    return 0


def draw(table: Path, out: Path) -> None:
    """Write the picture of a table.

    Raises:
        ConfigError: the table is not as `riposte bench --write` leaves it.
    """
    rows = rows_of(table)
    out.parent.mkdir(parents=True, exist_ok=True)
    out.write_bytes(benchmarks(goals_of(rows), contests_of(newest(rows))))


def goals_of(rows: tuple[Row, ...]) -> list[Goal]:
    """Return how far each benchmark is, the nearest to its goal last; those without one are not."""
    found: list[Goal] = []
    for name, row in newest(rows).items():
        value = row.over(row.main.value)
        if math.isnan(value):
            continue
        ends = [row.over(end) for end in (row.main.low, row.main.high) if end is not None]
        ends = [end for end in ends if not math.isnan(end)] or [value]
        before = [each.over(each.main.value) for each in rows if each.benchmark == name][:-1]
        sign = "≥" if row.is_at_least else "≤"
        found.append(
            Goal(
                label=name, value=value, low=min(ends), high=max(ends), before=before,
                text=f"{number(row.main.value)} ({sign} {row.goal:g})  {row.main.name}",
            )
        )  # fmt: skip
    return sorted(found, key=lambda goal: -goal.value)


def contests_of(last: dict[str, Row]) -> list[Contest]:
    """Return the same work side by side, of the benchmarks that have a row."""
    found: list[Contest] = []
    if row := last.get("peers"):
        ours = _bar(_OURS, Figure("ours", row.measured), is_ours=True)
        bars = [ours, *_peers(row, "samples/s of ", "")]
        found.append(_contest("Training", "samples/s", bars, is_more=True))
    if row := last.get("skill"):
        bars = _peers(row, "", ", from the start")
        found.append(_contest("To the same skill", "s", bars, is_more=False))
    if row := last.get("transports"):
        bars = _peers(row, "", ", CPU a MB")
        found.append(_contest("Bus", "CPU ms a MB", bars, is_more=False))
    return [contest for contest in found if len(contest.bars) > 1]


def _peers(row: Row, before: str, after: str) -> list[Bar]:
    """Return the figures beside the main one whose names begin and end so: one for each peer."""
    bars: list[Bar] = []
    for each in row.also:
        if each.name.startswith(before) and each.name.endswith(after) and "/ " not in each.name:
            peer = each.name[len(before) : len(each.name) - len(after)]
            is_ours = peer == "ours" or peer.startswith("ours ")
            label = peer.replace("ours", _OURS, 1) if is_ours else peer
            bars.append(_bar(label, each, is_ours=is_ours))
    return bars


def _contest(title: str, unit: str, bars: list[Bar], *, is_more: bool) -> Contest:
    return Contest(
        title, unit, is_more, sorted(bars, key=lambda bar: -bar.value if is_more else bar.value)
    )


def _bar(label: str, figure: Figure, *, is_ours: bool) -> Bar:
    low = figure.value if figure.low is None else figure.low
    high = figure.value if figure.high is None else figure.high
    return Bar(label, figure.value, low, high, is_ours)


if __name__ == "__main__":
    sys.exit(main())
