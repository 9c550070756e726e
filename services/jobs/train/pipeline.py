"""What `riposte train --phase all` does after training: tournament, styles, and the time of each.

``RUN/pipeline.json`` says which stages are done and how long each took, also when the run was
stopped in between: ``--resume`` skips what is done, as long as no training came after it.
"""

import contextlib
import importlib
import time
from collections.abc import Sequence
from pathlib import Path

import msgspec

from shared.runtime.files import atomic_write

FILE = "pipeline.json"
JOBS = (
    ("tournament", "services.jobs.tournament.command"),
    ("styles", "services.jobs.styles.command"),
)
"""Name and module of each stage; ``main([RUN])`` plays it."""
REPORT = "report"


class StageTime(msgspec.Struct, frozen=True, kw_only=True):
    """One stage of the pipeline."""

    name: str
    seconds: float
    """Over all attempts."""
    done: bool


class Pipeline(msgspec.Struct, frozen=True, kw_only=True):
    """How far a run's pipeline is."""

    schema: int = 1
    position: int = 0
    """Of the training ledger that these stages follow from."""
    stages: tuple[StageTime, ...] = ()

    def find(self, name: str) -> StageTime:
        """Return a stage, one not begun when it is not there."""
        known = {stage.name: stage for stage in self.stages}
        return known.get(name, StageTime(name=name, seconds=0.0, done=False))

    def replaced(self, stage: StageTime) -> "Pipeline":
        """Return the same with a stage as it is now."""
        others = tuple(other for other in self.stages if other.name != stage.name)
        return msgspec.structs.replace(self, stages=(*others, stage))


def is_begun(folder: Path) -> bool:
    """Return whether this run was begun with its whole pipeline."""
    return (folder / FILE).exists()


def read(folder: Path) -> Pipeline:
    """Return how far a run's pipeline is; nothing is done where the file is missing or damaged."""
    with contextlib.suppress(OSError, ValueError, RecursionError):
        return msgspec.json.decode((folder / FILE).read_bytes(), type=Pipeline)
    return Pipeline()


def write(folder: Path, pipeline: Pipeline) -> None:
    """Write it whole or not at all."""
    atomic_write(folder / FILE, msgspec.json.format(msgspec.json.encode(pipeline)) + b"\n")


def run_jobs(
    folder: Path,
    position: int,
    jobs: Sequence[tuple[str, str]] = JOBS,
    *,
    report_seconds: float = 0.0,
) -> int:
    """Do what is left after training; return the exit code of the first that fails, else 0.

    Args:
        folder: of the run.
        position: of its ledger; when it has moved, everything after training is done again.
        jobs: name and module of each stage.
        report_seconds: how long the report of the training took; one like it is written at the
            end.
    """
    found = read(folder)
    if found.position != position:
        found = Pipeline(position=position)
    found = found.replaced(StageTime(name=REPORT, seconds=report_seconds, done=True))
    write(folder, found)
    for name, module in jobs:
        stage = found.find(name)
        if stage.done:
            continue
        began = time.monotonic()
        code: int | None = None
        try:
            code = importlib.import_module(module).main([str(folder)])
        finally:
            seconds = stage.seconds + time.monotonic() - began
            after = StageTime(name=name, seconds=seconds, done=code == 0)
            found = found.replaced(after)
            write(folder, found)
        if code:
            return code
    return 0
