"""What is learned, over several seeds, with 95 % t-intervals over them.

``python -m benchmarks.learning static --seeds 3``: the antagonist against a player that holds
still, at most a million samples. ``python -m benchmarks.learning phase-one --seeds 3``: whole runs
of ``riposte train``, one after the other, or with ``--read DIR`` finished ones. ``python -m
benchmarks.learning exploitability --runs UNIFORM PFSP --seeds 3``: what fresh antagonists score
against the protagonists of phase two. ``--write`` keeps the figures in
``benchmarks/learning.json``, ``RESULTS.md`` and (phase one) ``docs/images/learning.png``.
"""

import argparse
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from benchmarks import exploitability, phase_one
from benchmarks.harness import ROOT
from benchmarks.seeds import t_interval
from services.jobs.bench import Check, Measurement, keep, report_of, text_of
from services.jobs.settings import Settings
from shared.errors import RiposteError
from shared.policy.players import scripted_player
from shared.runtime.process import THREAD_LIMITS

STATIC = "scripted:static"
KEPT = ROOT / "benchmarks" / "learning.json"
FIGURE = ROOT / "docs" / "images" / "learning.png"
IN_TARGET_GOAL = 0.95
STATIC_SAMPLES = 1_000_000
RESPONSE_SAMPLES = 500_000


def main(argv: Sequence[str] | None = None) -> int:
    """Measure; return 1 when a goal is missed by the mean over the seeds."""
    found = _parse(argv)
    os.environ.update(THREAD_LIMITS)
    seeds = range(found.first_seed, found.first_seed + found.seeds)
    try:
        if found.what == "static":
            samples = found.samples or STATIC_SAMPLES
            report = report_of(
                "learning static", lambda: static(seeds, samples, found.set), smoke=False
            )
        elif found.what == "exploitability":
            samples = found.samples or RESPONSE_SAMPLES
            report = report_of(
                "learning exploitability",
                lambda: exploitability.measure(found.runs, seeds, samples, found.set),
                smoke=False,
            )
        else:
            report = report_of("learning phase-one", lambda: _phase_one(found, seeds), smoke=False)
    except RiposteError as error:
        print(f"learning: {error}", file=sys.stderr)
        return 2
    print(text_of(report))
    if found.what == "phase-one":
        print(phase_one.table(report["runs"]))
    elif found.what == "exploitability":
        print(exploitability.table(report))
    if found.write:
        words = sys.argv[1:] if argv is None else argv
        _keep(found.what, report, f"python -m benchmarks.learning {' '.join(words)}")
    return 0 if all(check["met"] for check in (report["goal"], *report["checks"])) else 1


def _parse(argv: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.learning", description=__doc__)
    parser.add_argument("what", choices=("static", "phase-one", "exploitability"))
    parser.add_argument("--seeds", type=int, default=3, metavar="N", help="how many (%(default)s)")
    parser.add_argument("--first-seed", type=int, default=0, metavar="S")
    parser.add_argument("--samples", type=int, metavar="N",
                        help=f"static: at most so many ({STATIC_SAMPLES:,}); exploitability: of "
                        f"each best response ({RESPONSE_SAMPLES:,})")  # fmt: skip
    parser.add_argument("--out", type=Path, default=Path("runs/learning"), metavar="DIR",
                        help="phase-one: folder of the runs (%(default)s)")  # fmt: skip
    parser.add_argument("--read", type=Path, metavar="DIR", help="phase-one: runs made before")
    exploitability.add_arguments(parser)
    parser.add_argument("--set", action="append", default=[], metavar="SECTION.KEY=VALUE")
    parser.add_argument("--write", action="store_true", help="keep the figures in the repository")
    return parser.parse_args(argv)


def static(seeds: Sequence[int], samples: int, overrides: Sequence[str] = ()) -> Measurement:
    """Return how long the antagonist keeps its bat in the target of a player that holds still."""
    from benchmarks.best_response import Opponent, learn

    opponent = Opponent(STATIC, lambda: scripted_player(STATIC))
    settings = Settings.load(None, overrides)
    runs: list[dict[str, Any]] = []
    for seed in seeds:
        run = learn(settings, opponent, seed, samples, shaped_share=1.0)
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
    kept: dict[str, Any] = {}
    if KEPT.exists():
        kept = json.loads(KEPT.read_text(encoding="utf-8"))
    kept[what] = report | {"command": command}
    KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    keep(report, command)


if __name__ == "__main__":
    sys.exit(main())
