"""The scaling model: its coefficients from synthetic actors, and its predictions beside runs.

`python -m benchmarks.scale --write` keeps what was measured in ``scaling/measured.json``, renews
the tables and the figure of ``docs/scaling.md`` and adds a row to ``RESULTS.md``; ``--plan busy``
does with less on a machine that others use. Every run is kept in ``OUT/scale.jsonl`` as it ends,
and a stopped measurement goes on with ``--out OUT``.
"""

import argparse
import datetime
import json
import os
import sys
import tempfile
from pathlib import Path

import msgspec

from benchmarks.harness import ROOT
from benchmarks.scaling import document
from benchmarks.scaling.kept import KeptRuns
from benchmarks.scaling.measure import Found
from benchmarks.scaling.measure import measure as run_plan
from benchmarks.scaling.plan import BUSY, FULL, SMOKE, Plan
from services.jobs.bench import Check, Measurement, keep, report_of, text_of
from shared.runtime.files import atomic_write
from shared.runtime.logging import configure_logging

QUESTION = "how well the scaling model predicts runs of real and of up to 1,000 synthetic actors"
GOAL = 0.25
"""Median error of a prediction."""
RUNS = "scale.jsonl"
MEASURED = Path(__file__).parent / "scaling" / "measured.json"
PLANS = {"full": FULL, "busy": BUSY, "smoke": SMOKE}


def found_of(plan: Plan, runs: Path, *, only_kept: bool = False) -> Found:
    """Return what a plan finds, telling stderr of each run.

    Args:
        plan: what to run.
        runs: file of the runs; those in it are not made again.
        only_kept: run nothing more.
    """
    cores = len(os.sched_getaffinity(0))

    def say(text: str) -> None:
        print(text, file=sys.stderr, flush=True)

    return run_plan(plan, cores, KeptRuns(runs, say, only_kept=only_kept))


def measurement(found: Found) -> Measurement:
    """Return what was found as every benchmark says it."""
    rate = next(check for check in found.checks if check.unit == "samples/s")
    cost = found.coefficients
    most = max((run["actors"] for run in found.runs), default=0)
    return Measurement(
        value=rate.predicted,
        unit=f"samples/s ({rate.what}, {rate.actors} actors), predicted",
        limit=rate.measured,
        ratio=Check(
            name="median error of the predictions", value=found.error, goal=GOAL, goal_is="at most"
        ),
        runs=tuple(msgspec.to_builtins(check) | {"error": check.error} for check in found.checks),
        checks=(
            Check(name="actor, CPU a sample", value=1e6 * cost.actor_s, unit="us"),
            Check(name="learner's intake, main thread", value=1e6 * cost.ingest_s, unit="us"),
            Check(name="PPO, CPU a sample", value=1e6 * cost.update_s, unit="us"),
            Check(name="router, CPU a MB of rollouts", value=1e9 * cost.router_byte_s, unit="ms"),
            Check(name="bytes of a sample", value=cost.rollout_bytes),
            Check(name="synthetic actors at most", value=most),
            *(
                Check(name=f"memory of {one.process} then", value=one.resident_mb, unit="MB")
                for one in found.memory
            ),
        ),
        details=msgspec.to_builtins(found),
    )


def measure(smoke: bool) -> Measurement:
    """Return the errors of the model's predictions."""
    with tempfile.TemporaryDirectory() as folder:
        return measurement(found_of(SMOKE if smoke else FULL, Path(folder) / RUNS))


def main() -> None:
    """Measure, and keep it where the documents are made from it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plan", choices=PLANS, default="full", help="(%(default)s)")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument("--write", action="store_true", help="renew docs/scaling.md and add a row")
    parser.add_argument("--out", type=Path, metavar="DIR", help="of the runs; goes on with them")
    parser.add_argument("--finish", action="store_true", help="with the runs of --out, and no more")
    parser.add_argument("--read", action="store_true", help="renew the documents from what is kept")
    words = parser.parse_args()
    configure_logging(None)
    if words.read:
        document.write(ROOT / "docs", json.loads(MEASURED.read_bytes()))
        return
    stamp = datetime.datetime.now(datetime.UTC).strftime("%Y%m%d-%H%M%S")
    runs = (words.out or ROOT / "runs" / f"scale-{stamp}") / RUNS

    def found() -> Measurement:
        return measurement(found_of(PLANS[words.plan], runs, only_kept=words.finish))

    report = report_of("scale", found, smoke=False)
    print(json.dumps(report) if words.json else text_of(report))
    if words.write:
        kept = {
            key: report[key] for key in ("machine", "commit", "details", "ratio", "wall_s")
        } | {"plan": words.plan}  # fmt: skip
        atomic_write(MEASURED, msgspec.json.format(msgspec.json.encode(kept)) + b"\n")
        document.write(ROOT / "docs", kept)
        plan = "" if words.plan == "full" else f" --plan {words.plan}"
        keep(report, f"python -m benchmarks.scale{plan} --write")


if __name__ == "__main__":
    main()
