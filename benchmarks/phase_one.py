"""Phase one of `riposte train` over several seeds: who lowers whose score, and by how much."""

import statistics
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.harness import ROOT
from benchmarks.seeds import t_interval
from services.jobs.bench import Check, Measurement
from services.jobs.report.command import write_report
from services.jobs.report.summary import LOWERS_GOAL, RECOVERS_GOAL, Summary
from shared.errors import ConfigError
from shared.telemetry.seed_curves import SeedCurve, Shade, seed_curves

MEETINGS = {
    "A1 v static": ("antagonist 1", "static"),
    "A1 v P1": ("antagonist 1", "protagonist 1"),
    "A2 v P1": ("antagonist 2", "protagonist 1"),
    "A2 v static": ("antagonist 2", "static"),
    "A2 v P2": ("antagonist 2", "protagonist 2"),
}
"""Pairings by short name: A1 is the antagonist at the end of its first stage."""
LOWERS = "A1 v static - A1 v P1"
RECOVERS = "A2 v P1 - A1 v P1"


def run(out: Path, seed: int, overrides: Sequence[str]) -> Summary:
    """Return the summary of one run, made now, continued, or found finished.

    Raises:
        ConfigError: `riposte train` failed.
    """
    folder = (out / f"seed-{seed}").resolve()
    if (folder / "summary.json").exists():
        summary = load(folder)
        if summary.finished:
            return summary
    command = [sys.executable, "-P", "-m", "services.cli", "train", "--out", str(folder)]
    if (folder / "league.sqlite").exists():
        command.append("--resume")
    else:
        command += ["--seed", str(seed), *(word for o in overrides for word in ("--set", o))]
    done = subprocess.run(command, cwd=ROOT, check=False)
    if done.returncode:
        raise ConfigError(f"the run of seed {seed} ended with {done.returncode}: see {folder}")
    return load(folder)


def read(folder: Path) -> list[Summary]:
    """Return the summaries of the finished runs in a folder.

    Raises:
        ConfigError: there is none.
    """
    ledgers = sorted(folder.glob("*/league.sqlite"))
    summaries = [load(ledger.parent) for ledger in ledgers]
    finished = [summary for summary in summaries if summary.finished]
    if not finished:
        raise ConfigError(f"{folder} holds no finished runs; expected {folder}/seed-0 and so on")
    return sorted(finished, key=lambda summary: summary.seed)


def load(folder: Path) -> Summary:
    """Return a run's summary, from its ledger where no report was written yet."""
    path = folder / "summary.json"
    if not path.exists():
        return write_report(folder, pictures=False)
    try:
        return msgspec.json.decode(path.read_bytes(), type=Summary)
    except msgspec.DecodeError as error:
        raise ConfigError(f"{path} is no summary of this version: {error}") from error


def figures(summary: Summary) -> dict[str, Any]:
    """Return the figures of one run.

    Raises:
        ConfigError: the run has not played one of the pairings.
    """
    played = {(m.antagonist, m.protagonist): m for m in summary.meetings}
    missing = [name for name, pair in MEETINGS.items() if pair not in played]
    if missing:
        raise ConfigError(
            f"run {summary.folder} did not play {', '.join(missing)}: phase one must have two "
            "iterations and its evaluation"
        )
    meetings = {name: played[pair] for name, pair in MEETINGS.items()}
    scores = {name: m.score.mean if m.score else 0.0 for name, m in meetings.items()}
    lowers = scores["A1 v static"] - scores["A1 v P1"]
    return {
        "seed": summary.seed,
        "scores": scores,
        LOWERS: lowers,
        RECOVERS: scores["A2 v P1"] - scores["A1 v P1"],
        "ratio": lowers,
        "camping_share": {name: m.camping_share for name, m in meetings.items()},
        "camping_points": {name: m.camping_points for name, m in meetings.items()},
        "in_target_share": {name: m.in_target_share for name, m in meetings.items()},
        "bouts": {name: m.bouts for name, m in meetings.items()},
        "samples": summary.samples,
        "samples_per_s": summary.samples_per_s,
        "seconds": summary.seconds,
        "incidents": summary.incident_counts,
        "commit": summary.origin.commit,
        "machine": summary.origin.machine,
    }


def check(name: str, values: Sequence[float], unit: str = "", goal: float | None = None) -> Check:
    """Return the mean over seeds with its interval, as a line of a report."""
    found = t_interval(values)
    return Check(
        name=name, value=found["mean"], unit=unit, goal=goal, low=found["low"], high=found["high"]
    )


def measurement(summaries: Sequence[Summary]) -> Measurement:
    """Return what several seeds showed."""
    runs = tuple(figures(summary) for summary in summaries)

    def over_seeds(name: str, of: str) -> list[float]:
        return [run[of][name] for run in runs]

    points = "points a bout"
    return Measurement(
        value=statistics.fmean(over_seeds("A1 v P1", "scores")),
        unit="points a bout of A1 v P1, beside A1 v static",
        limit=statistics.fmean(over_seeds("A1 v static", "scores")),
        ratio=check(LOWERS, [run[LOWERS] for run in runs], points, LOWERS_GOAL),
        runs=runs,
        checks=(
            check(RECOVERS, [run[RECOVERS] for run in runs], points, RECOVERS_GOAL),
            *(check(name, over_seeds(name, "scores"), points) for name in MEETINGS),
            *(
                check(f"camping's share of points, {name}", over_seeds(name, "camping_share"))
                for name in MEETINGS
            ),
            check("samples a run", [run["samples"] for run in runs]),
            check("wall time a run", [run["seconds"] for run in runs], "s"),
        ),
    )


def table(runs: Sequence[dict[str, Any]]) -> str:
    """Return one line a seed."""
    names = [*MEETINGS, LOWERS, RECOVERS]
    lines = ["  seed " + "  ".join(names) + "  samples  seconds"]
    for run in runs:
        values = {**run["scores"], LOWERS: run[LOWERS], RECOVERS: run[RECOVERS]}
        cells = "  ".join(f"{values[name]:>{len(name)},.0f}" for name in names)
        millions = run["samples"] / 1e6
        lines.append(f"  {run['seed']:<4} {cells}  {millions:>6.2f}M  {run['seconds']:>7.0f}")
    return "\n".join(lines)


def draw(summaries: Sequence[Summary], path: Path) -> None:
    """Draw the antagonist's score over samples, a line for each seed, stages shaded."""
    curves = [
        SeedCurve.joined(
            f"seed {summary.seed}",
            [(stage.curve.samples, stage.curve.mean) for stage in summary.stages],
        )
        for summary in summaries
    ]
    shades = [
        Shade(
            of_all[0].agent,
            f"{of_all[0].agent} {of_all[0].iteration} learns",
            statistics.fmean(stage.samples_before for stage in of_all),
            statistics.fmean(stage.samples_before + stage.samples for stage in of_all),
        )
        for of_all in zip(*(summary.stages for summary in summaries), strict=True)
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(seed_curves(curves, shades, "samples both agents learned from"))
