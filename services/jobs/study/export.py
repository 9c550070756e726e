"""`riposte study export`: writes the tables of a study as CSV, blinded unless asked otherwise."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from shared.study.csv_export import export
from shared.study.folder import open_study
from shared.study.recorded import refresh


def main(argv: Sequence[str]) -> int:
    """Run ``riposte study export``; return the exit code."""
    parser = argparse.ArgumentParser(prog="riposte study export", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's")
    parser.add_argument("--out", type=Path, required=True, metavar="DIR2", help="a new folder")
    parser.add_argument(
        "--unblind", action="store_true", help="conditions by name, and who played, by key.toml"
    )
    found = parser.parse_args(argv)
    study = open_study(found.folder)
    refresh(study)
    for file, rows in export(study, found.out, found.unblind).items():
        print(f"{found.out / file}: {rows} rows")
    return 0
