"""Training and play together on one machine, for hours: does anything grow?

`make soak` runs it for two hours (``SOAK_MINUTES=...`` for another time). Every few seconds memory,
file handles, threads and CPU time of every process, lateness of the control, rate of the training
and use of the disk go to ``OUT/soak.jsonl``; at the end slopes are judged. What a kill leaves is
read by ``python -m benchmarks.soak --read OUT/soak.jsonl``.
"""

import argparse
import datetime
import json
import os
import shutil
import sys
import time
from pathlib import Path

import msgspec
import numpy as np
import psutil

from benchmarks.control import Site, live_site
from benchmarks.harness import ROOT, on_cores
from benchmarks.soaking import page
from benchmarks.soaking.samples import Ended, Sample, Started, disk_use, read, use_of
from benchmarks.soaking.verdict import Verdict, judge
from benchmarks.training_run import ENDLESS, WARM_VERSION, TrainingRun, training_run
from services.jobs.doctor.machine import processor
from services.learner.config import LearnerConfig
from shared.errors import ConfigError, RiposteError
from shared.runtime.build import commit
from shared.runtime.logging import configure_logging

MINUTES, SAMPLE_SECONDS = 120.0, 5.0
LEAST_FREE_BYTES = 2 << 30
FILE = "soak.jsonl"
PAGE = ROOT / "docs" / "reliability.md"


def sample(at: float, training: TrainingRun, site: Site) -> Sample:
    """Return how everything stands, and forget the ticks that were heard.

    Args:
        at: seconds since the soak began.
        training: the one job.
        site: the other.

    Raises:
        RiposteError: a process is gone.
    """
    pids = {f"train/{name}": pid for name, pid in training.pids.items()}
    pids |= {f"play/{name}": pid for name, pid in site.pids.items()}
    late = [gate.lateness_ms for gate in site.gates]
    site.gates.clear()
    counts = {} if site.status is None else site.status.counters
    try:
        processes = {name: use_of(pid) for name, pid in pids.items()}
    except psutil.Error as error:
        raise RiposteError(f"a process is gone: {error}") from error
    return Sample(
        at=at,
        processes=processes,
        version=training.newest_checkpoint(),
        batch_samples=LearnerConfig().batch_samples,
        lateness_ms=_percentiles(late),
        ticks=counts.get("ticks", 0) + counts.get("ticks_lost", 0),
        ticks_late=counts.get("ticks_late", 0),
        ticks_lost=counts.get("ticks_lost", 0),
        bouts=site.match.finished,
        disk_bytes={"train": disk_use(training.folder), "play": disk_use(site.folder)},
        load=os.getloadavg()[0],
    )


def _percentiles(values: list[float]) -> tuple[float, float, float] | None:
    if not values:
        return None
    p50, p99, most = np.percentile(np.array(values), (50, 99, 100))
    return float(p50), float(p99), float(most)


def soak(path: Path, minutes: float, every: float) -> None:
    """Run both jobs and write the samples.

    Args:
        path: of the samples' file.
        minutes: how long.
        every: seconds between two samples.
    """
    cores = sorted(os.sched_getaffinity(0))
    started = Started(
        minutes=minutes, cores=len(cores), processor=processor(), commit=commit() or "unknown"
    )
    path.write_bytes(msgspec.json.encode(started) + b"\n")
    try:
        with on_cores(*(cores[1:] or cores)), training_run(ENDLESS) as training:
            training.wait_for_version(WARM_VERSION)
            with on_cores(cores[0]), live_site() as site:
                site.until_fencing()
                site.fresh_status()
                _watch(path, training, site, 60.0 * minutes, every)
    except RiposteError as error:
        with path.open("ab") as file:
            file.write(msgspec.json.encode(Ended(ended=str(error))) + b"\n")


def _watch(path: Path, training: TrainingRun, site: Site, seconds: float, every: float) -> None:
    """Sample until the time is over."""
    begin = time.monotonic()
    due_at = begin
    site.gates.clear()
    with path.open("ab", buffering=0) as file:
        while (now := time.monotonic()) < begin + seconds + every:
            site.tick()
            training.check()
            if now >= due_at:
                due_at += every
                line = sample(now - begin, training, site)
                file.write(msgspec.json.encode(line) + b"\n")
                if shutil.disk_usage(site.folder).free < LEAST_FREE_BYTES:
                    raise RiposteError(f"the disk of {site.folder} is nearly full")


def report(path: Path, *, write: bool) -> Verdict:
    """Print the verdict on a file of samples; write it into the page when asked to.

    Raises:
        ConfigError: there is too little in it.
    """
    kept = read(path)
    try:
        verdict = judge(kept.samples, kept.ended)
    except ValueError as error:
        raise ConfigError(f"{path}: {error}{f' ({kept.ended})' if kept.ended else ''}") from error
    print(page.text_of(verdict))
    if write:
        page.write(PAGE, page.block_of(verdict, kept))
    return verdict


def main() -> int:
    """Soak, or read what was kept; return 1 when a criterion is missed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=MINUTES, help="(%(default)g)")
    parser.add_argument("--every", type=float, default=SAMPLE_SECONDS, help="s (%(default)g)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the samples")
    parser.add_argument("--read", type=Path, metavar="FILE", help="judge this file, run nothing")
    parser.add_argument("--json", action="store_true", help="print the samples' file at the end")
    parser.add_argument("--write", action="store_true", help="write docs/reliability.md")
    found = parser.parse_args()
    configure_logging(None)
    try:
        path = found.read or _new_file(found.out)
        if found.read is None:
            print(f"soaking for {found.minutes:g} minutes; samples in {path}", flush=True)
            soak(path, found.minutes, found.every)
        verdict = report(path, write=found.write)
    except ConfigError as error:
        print(f"soak: {error}", file=sys.stderr)
        return 2
    if found.json:
        print(json.dumps({"file": str(path), "outcome": verdict.outcome}))
    return 1 if verdict.outcome == "missed" else 0


def _new_file(folder: Path | None) -> Path:
    """Return where the samples go.

    Raises:
        ConfigError: a soak is there already.
    """
    stamp = datetime.datetime.now(datetime.UTC).strftime("%Y%m%d-%H%M%S")
    folder = folder or ROOT / "runs" / f"soak-{stamp}"
    folder.mkdir(parents=True, exist_ok=True)
    if (path := folder / FILE).exists():
        raise ConfigError(f"{path} is there already: choose another --out, or judge it with --read")
    return path


if __name__ == "__main__":
    sys.exit(main())
