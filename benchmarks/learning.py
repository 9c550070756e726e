"""What is learned, over several seeds, with 95 % t-intervals over them.

``python -m benchmarks.learning static --seeds 3``: the antagonist against a player that holds
still, at most a million samples. ``python -m benchmarks.learning phase-one --seeds 3``: whole runs
of ``riposte train``, one after the other, or with ``--read DIR`` finished ones. ``--write`` keeps
the figures in ``benchmarks/learning.json``, ``RESULTS.md`` and ``docs/images/learning.png``.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks import phase_one
from benchmarks.harness import ROOT
from benchmarks.seeds import t_interval
from services.jobs.bench import RESULTS, Check, Measurement, add_row, report_of, text_of
from services.jobs.settings import Settings
from shared.errors import RiposteError
from shared.runtime.process import THREAD_LIMITS

KEPT = ROOT / "benchmarks" / "learning.json"
FIGURE = ROOT / "docs" / "images" / "learning.png"
IN_TARGET_GOAL = 0.95


def main(argv: Sequence[str] | None = None) -> int:
    """Measure; return 1 when a goal is missed by the mean over the seeds."""
    found = _parse(argv)
    os.environ.update(THREAD_LIMITS)
    seeds = range(found.first_seed, found.first_seed + found.seeds)
    try:
        if found.what == "static":
            report = report_of(
                "learning static", lambda: static(seeds, found.samples, found.set), smoke=False
            )
        else:
            report = report_of("learning phase-one", lambda: _phase_one(found, seeds), smoke=False)
    except RiposteError as error:
        print(f"learning: {error}", file=sys.stderr)
        return 2
    print(text_of(report))
    if found.what == "phase-one":
        print(phase_one.table(report["runs"]))
    if found.write:
        words = sys.argv[1:] if argv is None else argv
        _keep(found.what, report, f"python -m benchmarks.learning {' '.join(words)}")
    return 0 if all(check["met"] for check in (report["goal"], *report["checks"])) else 1


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.learning", description=__doc__)
    parser.add_argument("what", choices=("static", "phase-one"))
    parser.add_argument("--seeds", type=int, default=3, metavar="N", help="how many (%(default)s)")
    parser.add_argument("--first-seed", type=int, default=0, metavar="S")
    parser.add_argument("--samples", type=int, default=1_000_000, help="static: at most so many")
    parser.add_argument("--out", type=Path, default=Path("runs/learning"), metavar="DIR",
                        help="phase-one: folder of the runs (%(default)s)")  # fmt: skip
    parser.add_argument("--read", type=Path, metavar="DIR", help="phase-one: runs made before")
    parser.add_argument("--set", action="append", default=[], metavar="SECTION.KEY=VALUE")
    parser.add_argument("--write", action="store_true", help="keep the figures in the repository")
    return parser.parse_args(argv)


def static(seeds: Sequence[int], samples: int, overrides: Sequence[str] = ()) -> Measurement:
    """Return how long the antagonist keeps its bat in the target of a player that holds still."""
    from benchmarks.static_opponent import learn

    settings = Settings.load(None, overrides)
    runs: list[dict[str, Any]] = []
    for seed in seeds:
        run = learn(settings, seed, samples)
        print(
            f"seed {seed}: {run['in_target_share']:.3f} of the steps in the target after "
            f"{run['samples']:,} samples, {run['training_seconds']:.0f} s",
            file=sys.stderr,
        )
        runs.append(run | {"ratio": run["in_target_share"]})
    share = t_interval([run["in_target_share"] for run in runs])
    return Measurement(
        value=share["mean"],
        unit="of the steps in the target",
        limit=1.0,
        ratio=Check(
            name="share of steps in target v static", value=share["mean"], goal=IN_TARGET_GOAL,
            low=share["low"], high=share["high"],
        ),
        runs=tuple(runs),
        checks=(
            phase_one.check("score", [run["score"] for run in runs], "points a bout"),
            phase_one.check("camping gave", [run["camping_points"] for run in runs], "points"),
            phase_one.check("samples", [run["samples"] for run in runs]),
            phase_one.check("training took", [run["training_seconds"] for run in runs], "s"),
        ),
    )  # fmt: skip


def _phase_one(found: argparse.Namespace, seeds: Sequence[int]) -> Measurement:
    """Run or read the runs and return their figures; draw them beside the runs."""
    if found.read is None:
        summaries = [phase_one.run(found.out, seed, found.set) for seed in seeds]
    else:
        summaries = phase_one.read(found.read)
    phase_one.draw(summaries, FIGURE if found.write else (found.read or found.out) / "learning.png")
    return phase_one.measurement(summaries)


def _keep(what: str, report: dict[str, Any], command: str) -> None:
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    kept[what] = report | {"command": command}
    KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    add_row(KEPT.with_name(RESULTS), report, command)


if __name__ == "__main__":
    sys.exit(main())
