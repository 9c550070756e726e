"""Small serial runs, and everything they leave behind."""

import contextlib
import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from services.jobs.settings import Settings
from services.jobs.train.serial import SerialRun
from tests.integration.small import SMALL

RUN = "serial-run"


@dataclass(frozen=True)
class Remains:
    """What a run leaves, byte for byte."""

    snapshots: dict[str, bytes]
    ledger: list[tuple[object, ...]]
    """Rows, times included."""
    checkpoints: dict[str, bytes]
    """Weights, optimiser, normaliser and random state of each learner."""
    cuts: dict[str, bytes]
    """Physics, scoreboards and random state of the actor."""


def run(
    folder: Path,
    *,
    resume: bool = False,
    ticks: int | None = None,
    record: bool = False,
    overrides: tuple[str, ...] = (),
    look: Callable[[SerialRun], None] | None = None,
) -> int:
    """Run to the end, or for so many ticks; return the number of ticks.

    Whoever leaves after ``ticks`` leaves as a killed process does: nothing is finished.
    """
    settings = Settings.load(None, [*SMALL, "train.record=false", *overrides])
    done = 0
    with contextlib.closing(
        SerialRun(settings, folder, RUN, resume=resume, record=record)
    ) as serial:
        while not serial.finished and done != ticks:
            serial.tick()
            done += 1
            assert done < 2000, serial.actor.health()
        if look is not None:
            look(serial)
    return done


def remains(folder: Path) -> Remains:
    """Return what lies in the folder of a run."""

    def files(pattern: str) -> dict[str, bytes]:
        paths = sorted(folder.glob(pattern))
        return {str(path.relative_to(folder)): path.read_bytes() for path in paths}

    with contextlib.closing(sqlite3.connect(folder / "league.sqlite")) as connection:
        rows = connection.execute("SELECT seq, kind, key, body, at_ns FROM events ORDER BY seq")
        ledger = rows.fetchall()
    return Remains(
        snapshots=files("snapshots/*.safetensors"),
        ledger=ledger,
        checkpoints=files("learner/*/*.safetensors"),
        cuts=files("serial/*.safetensors"),
    )


def assert_same(found: Remains, wanted: Remains) -> None:
    """Fail with the first difference, not with a page of bytes."""
    for own, other in zip(found.ledger, wanted.ledger, strict=False):
        assert own == other, f"{own} is not\n{other}"
    assert len(found.ledger) == len(wanted.ledger)
    for kind in ("snapshots", "checkpoints", "cuts"):
        own, other = getattr(found, kind), getattr(wanted, kind)
        assert list(own) == list(other)
        assert [name for name in own if own[name] != other[name]] == []
