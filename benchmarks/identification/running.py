"""Runs trials over processes; each finished one is a line of a file: a second call goes on."""

import json
import multiprocessing
import os
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.identification.baselines import baselines
from benchmarks.identification.explainable import explainable
from benchmarks.identification.judging import judged, record_of
from benchmarks.identification.protocol import CELLS, Trial
from shared.clock import SystemClock
from shared.errors import RiposteError
from shared.identification.catalogue import effects
from shared.identification.dataset.types import Dataset
from shared.identification.find import identify
from shared.identification.fitting.saved import load
from shared.identification.hidden.generator import hide, simulated
from shared.identification.hidden.truth import read_truth
from shared.identification.progress import silent
from shared.identification.search.begin import begin
from shared.identification.search.searched import Search
from shared.runtime.build import commit
from shared.runtime.process import THREAD_LIMITS

PROCESSES = 2


def finished(path: Path) -> list[dict[str, Any]]:
    """Return the records that a file has; a line cut off by a crash does not count."""
    if not path.exists():
        return []
    found: dict[str, dict[str, Any]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:
            continue
        found[record["key"]] = record
    return list(found.values())


def run(
    trials: Sequence[Trial],
    path: Path,
    baselines_every: int,
    processes: int = PROCESSES,
    minutes: float | None = None,
    skipped: int = 0,
    cells: Collection[str] = CELLS,
) -> list[dict[str, Any]]:
    """Return the records of all trials that are done, those done before included.

    Cells take turns, so that what is cut short says something of each.

    Args:
        trials: what is to be done.
        path: of the file, JSON lines.
        baselines_every: on every so many data sets the baselines run, too; 0: on none.
        processes: how many at once.
        minutes: after which no trial is begun; None for as long as it takes.
        skipped: so many of the first are left out: those that code was mended by.
        cells: of which trials are run.
    """
    trials = [trial for trial in by_turns(trials)[skipped:] if trial.cell in cells]
    ends_at = None if minutes is None else SystemClock().now() + 60.0 * minutes
    done = {record["key"] for record in finished(path)}
    left = [
        (trial, bool(baselines_every) and number % baselines_every == 0, ends_at)
        for number, trial in enumerate(trials)
        if trial.key not in done
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    os.environ.update(THREAD_LIMITS)
    context = multiprocessing.get_context("spawn")
    with path.open("a", encoding="utf-8") as file, context.Pool(processes) as pool:
        for number, record in enumerate(pool.imap_unordered(one, left), 1):
            if record is None:
                continue
            file.write(json.dumps(record) + "\n")
            file.flush()
            print(f"{number}/{len(left)} {record['key']}: {_said(record)}", file=sys.stderr)
    wanted = {trial.key for trial in trials}
    return [record for record in finished(path) if record["key"] in wanted]


def by_turns(trials: Sequence[Trial]) -> list[Trial]:
    """Return the trials so that each cell is spread evenly over all of them.

    Within a cell they are shuffled, always alike: what is cut short is of every effect and arm.
    Those that came to the protocol later follow in the same way.
    """
    later = [trial for trial in trials if trial.is_later]
    return _mixed([trial for trial in trials if not trial.is_later]) + _mixed(later)


def _mixed(trials: Sequence[Trial]) -> list[Trial]:
    counts = Counter(trial.cell for trial in trials)
    seen: Counter[str] = Counter()
    places: list[float] = []
    order = np.random.default_rng(0).permutation(len(trials))
    trials = [trials[index] for index in order]
    for trial in trials:
        places.append((seen[trial.cell] + 0.5) / counts[trial.cell])
        seen[trial.cell] += 1
    return [trials[index] for index in sorted(range(len(trials)), key=lambda one: places[one])]


def one(job: tuple[Trial, bool, float | None]) -> dict[str, Any] | None:
    """Make a data set, let the finder look at it, and return the record; None when time is up."""
    trial, with_baselines, ends_at = job
    if ends_at is not None and SystemClock().now() > ends_at:
        return None
    with tempfile.TemporaryDirectory() as folder:
        data, steps = Path(folder) / "data", Path(folder) / "steps"
        steps.mkdir()
        try:
            dataset = hide(data, trial.recipe)
            truth = read_truth(data)
            started_at = time.process_time()
            finding = identify(
                dataset,
                seed=trial.recipe.seed,
                resume_folder=steps,
                without=tuple(sorted(trial.without)),
            )
            cpu_s = time.process_time() - started_at
            record = record_of(trial, truth, finding.verdict, cpu_s)
            if trial.cell == "tie" and finding.verdict.ties:
                record["is_told_apart"] = _is_told_apart(trial)
            if trial.cell == "single":
                (hidden,) = truth.effect
                begun = _begun(dataset, trial.recipe.seed, steps)
                record["explainable"] = explainable(begun, hidden)
        except Exception as error:  # a defect counts as one, and the others go on
            traceback.print_exc()
            said = str(error) if isinstance(error, RiposteError) else repr(error)
            return {"key": trial.key, "cell": trial.cell, "error": said, "commit": commit()}
        record["commit"] = commit()
        if with_baselines:
            begun = _begun(dataset, trial.recipe.seed, steps)
            record["baselines"] = baselines(begun, trial.recipe.seed)
    return record


def _begun(dataset: Dataset, seed: int, steps: Path) -> Search:
    """Return a search whose base is what the finder fitted, as it kept that."""
    return begin(
        dataset, seed=seed, progress=silent, without=frozenset(), catalogue=effects(),
        fits=load(steps, dataset, seed),
    )  # fmt: skip


def _is_told_apart(trial: Trial) -> bool:
    """Return whether the truth of a tie is named from the motion that the tie asks for.

    That is all over where the arm may go, held, swung and crept along.
    """
    dataset, truth = simulated(replace(trial.recipe, reach=1.0))
    verdict = identify(dataset, seed=trial.recipe.seed).verdict
    return judged(record_of(trial, truth, verdict, 0.0)).has_place


def _said(record: dict[str, Any]) -> str:
    if "error" in record:
        return f"error: {record['error']}"
    names = [f"{each['name']} {each['where']}".strip() for each in record["named"]]
    return f"{record['verdict']} {', '.join(names)} ({record['cpu_s']:.0f} CPU s)"
