"""`riposte doctor`: checks this machine and says what to do about what it finds."""

import argparse
import json
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec

from services.jobs.doctor import machine, software
from services.jobs.doctor.finding import Finding

MARKS = {"ok": "✓", "warn": "!", "fail": "✗"}


def checks(folder: Path, *, is_quick: bool) -> list[tuple[str, Callable[[], Finding]]]:
    """Return the checks in the order they are made.

    Args:
        folder: where runs will be written.
        is_quick: leave out those that start a process.
    """
    found: list[tuple[str, Callable[[], Finding]]] = [
        ("python", software.check_python),
        ("source", software.check_source),
        ("packages", software.check_packages),
        ("training extra", software.check_training),
        ("cores", machine.check_cores),
        ("memory", machine.check_memory),
        ("disk", lambda: machine.check_disk(folder)),
        ("shared memory", machine.check_shared_memory),
        ("open files", machine.check_open_files),
        ("ports", machine.check_ports),
        ("bus", machine.check_bus),
    ]
    if not is_quick:
        found += [
            ("pictures", lambda: software.check_pictures(Path(tempfile.gettempdir()))),
            ("torch threads", software.check_torch),
        ]
    return found


def main(argv: Sequence[str]) -> int:
    """Run ``riposte doctor``; return 1 when something essential fails."""
    parser = argparse.ArgumentParser(prog="riposte doctor", description=__doc__)
    parser.add_argument(
        "--out", type=Path, default=Path("runs"), metavar="DIR",
        help="where runs will be written (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="leave out drawing and torch")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    found = parser.parse_args(argv)
    findings: dict[str, Finding] = {}
    for name, check in checks(found.out, is_quick=found.quick):
        findings[name] = check()
        if not found.json:
            print(line(name, findings[name]), flush=True)
    is_fit = all(finding.state != "fail" for finding in findings.values())
    if found.json:
        print(json.dumps({"fit": is_fit, "checks": msgspec.to_builtins(findings)}))
    else:
        print("this machine is fit for training" if is_fit else "mend what is marked ✗ first")
    return 0 if is_fit else 1


def line(name: str, finding: Finding) -> str:
    """Return a finding as a person reads it."""
    advice = f"\n    → {finding.advice}" if finding.advice else ""
    return f"{MARKS[finding.state]} {name:<15} {finding.detail}{advice}"
