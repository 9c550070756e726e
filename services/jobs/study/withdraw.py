"""`riposte study withdraw`: deletes everything of a participant; one line says somebody left."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from shared.clock import SystemClock
from shared.study.folder import CHANGES
from shared.study.withdrawal import withdraw


def main(argv: Sequence[str]) -> int:
    """Run ``riposte study withdraw``; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="riposte study withdraw",
        description=f"{__doc__} At a terminal the name is asked for once more.",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="the study's")
    parser.add_argument("--participant", required=True, metavar="ID", help="sub-01")
    found = parser.parse_args(argv)
    if sys.stdin.isatty():
        asked = input(f"this cannot be undone; type {found.participant} to delete it all: ")
        if asked.strip() != found.participant:
            print("nothing was deleted")
            return 1
    others = withdraw(found.folder, found.participant, SystemClock())
    print(f"deleted; {found.folder / CHANGES} says that somebody withdrew, and not who")
    if others:
        print("made before, and perhaps of their data, too: make anew or delete")
        for path in others:
            print(f"  {path}")
    print("copies elsewhere (exports, backups, the list of names) are yours to delete")
    return 0
