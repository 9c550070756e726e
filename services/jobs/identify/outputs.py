"""Writes what `riposte identify` leaves behind, each file whole or not at all."""

from dataclasses import dataclass
from pathlib import Path

import msgspec

from services.jobs.identify.overlay import write_overlay
from services.jobs.identify.page import About, report_page
from shared.identification.conclusion.evidence import Evidence
from shared.identification.conclusion.model_file import model_file
from shared.identification.dataset.types import Dataset
from shared.identification.verdict import Verdict
from shared.runtime.files import atomic_write

VERDICT_FILE = "verdict.json"
PAGE_FILE = "report.html"
RECORDING_FILE = "recording.rrd"
MODEL_FILES = ("model.toml", "model.xml")


@dataclass(frozen=True)
class Made:
    """Of what, and by which command."""

    dataset: Dataset
    name: str
    """Of the data set."""
    command: str


def write_all(folder: Path, verdict: Verdict, evidence: Evidence, made: Made) -> None:
    """Write verdict, extended model, report and recording into a folder.

    Raises:
        RiposteError: a file cannot be written; those before it are there and whole.
    """
    indented = msgspec.json.format(msgspec.json.encode(verdict), indent=1)
    atomic_write(folder / VERDICT_FILE, indented)
    model = model_file(made.dataset, verdict)
    atomic_write(folder / model.name, model.text.encode())
    about = About(made.name, made.command, model.name, model.carried)
    page = report_page(verdict, evidence, about)
    atomic_write(folder / PAGE_FILE, page.encode())
    write_overlay(folder / RECORDING_FILE, made.dataset, verdict, evidence)
