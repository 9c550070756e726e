"""`riposte study analyse`: every statistic of a study, as a report, as JSON and as CSV tables."""

import argparse
import textwrap
from collections.abc import Sequence
from pathlib import Path

import msgspec

from shared.study.analysis.results import Results, analyse_folder, write_analysis
from shared.study.folder import open_study
from shared.study.journal import read_journal
from shared.study.recorded import refresh
from shared.study.tables import load_study

WIDTH = 88


def main(argv: Sequence[str]) -> int:
    """Run ``riposte study analyse``; return the exit code."""
    parser = argparse.ArgumentParser(prog="riposte study analyse", description=__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="where the report goes (default: DIR/analysis)"
    )
    parser.add_argument(
        "--unblind", action="store_true", help="conditions by name, by key.toml; else by label"
    )
    parser.add_argument("--json", action="store_true", help="print the results as JSON")
    found = parser.parse_args(argv)
    out: Path = found.out or found.folder / "analysis"
    study = open_study(found.folder)
    if any(read_journal(folder) for _, _, folder in study.sessions()):
        refresh(study)  # whoever was killed may not have come to it
    tables = load_study(found.folder, unblind=found.unblind)
    analysis = analyse_folder(found.folder, tables)
    written = write_analysis(analysis, out)
    if found.json:
        print(msgspec.json.encode(analysis.results).decode())
        return 0
    print(summary_text(analysis.results))
    print(f"\n{len(written)} files in {out}, first {written[0]}")
    return 0


def summary_text(results: Results) -> str:
    """Return the sentences of all chapters on one screen."""
    lines = [results.title, ""]
    for chapter in results.chapters:
        if said := chapter.says[: chapter.headlines]:
            text = f"{chapter.title}: {' '.join(said)}"
            lines += [*textwrap.wrap(text, WIDTH, subsequent_indent="  "), ""]
    return "\n".join(lines).rstrip()
