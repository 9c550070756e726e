"""``python -m studies.closing_the_loop``: the whole study, or what is left of it.

Each stage keeps what it made in OUT and is not done again: hide, record, find, train, play,
report. A study that was stopped goes on with the same command.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import structlog

from shared.clock import SystemClock
from shared.errors import RiposteError
from shared.runtime.files import RunLock
from shared.runtime.logging import configure_logging
from studies.closing_the_loop.finding import find
from studies.closing_the_loop.playing import play
from studies.closing_the_loop.protocol import SMOKE, Folders, Protocol
from studies.closing_the_loop.recording import hide, record
from studies.closing_the_loop.report import report
from studies.closing_the_loop.training import train

Say = Callable[[str], None]
Stage = Callable[[Protocol, Folders, Say], None]
STAGES: dict[str, Stage] = {
    "hide": hide, "record": record, "find": find, "train": train, "play": play, "report": report,
}  # fmt: skip
EXIT_BAD_INPUT = 2

log = structlog.get_logger()


def main(argv: Sequence[str] | None = None) -> int:
    """Do the stages asked for; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m studies.closing_the_loop", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, default=Path("runs/closing-the-loop"), help="folder (%(default)s)"
    )
    parser.add_argument(
        "--stages", nargs="+", choices=tuple(STAGES), default=list(STAGES), metavar="STAGE",
        help=f"only these: {', '.join(STAGES)}",
    )  # fmt: skip
    parser.add_argument(
        "--smoke", action="store_true", help="as small as can be; the results mean nothing"
    )
    found = parser.parse_args(argv)
    protocol = SMOKE if found.smoke else Protocol()
    folders = Folders(found.out)
    clock = SystemClock()
    try:
        with RunLock(folders.root):
            configure_logging(folders.root / "logs" / "study.jsonl", bound={"service": "study"})
            for number, (name, stage) in enumerate(STAGES.items(), 1):
                if name not in found.stages:
                    continue
                began = clock.now()
                _say(f"[{number} of {len(STAGES)}] {name}")
                stage(protocol, folders, _say)
                _say(f"[{number} of {len(STAGES)}] {name}: {clock.now() - began:.0f} s")
    except RiposteError as error:
        sys.stderr.write(f"{error}\n")
        return EXIT_BAD_INPUT
    return 0


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()


if __name__ == "__main__":
    sys.exit(main())
