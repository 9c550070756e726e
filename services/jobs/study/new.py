"""`riposte study new`: makes the folder of a study from a protocol."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from shared.clock import SystemClock
from shared.errors import ConfigError
from shared.runtime.service import version
from shared.study.folder import PROTOCOL, make_study
from shared.study.protocol_file import SHIPPED, shipped_protocol


def main(argv: Sequence[str]) -> int:
    """Run ``riposte study new``; return the exit code."""
    parser = argparse.ArgumentParser(prog="riposte study new", description=__doc__)
    parser.add_argument(
        "protocol", metavar="PROTOCOL", help=f"{', '.join(SHIPPED)}, or a protocol's file (TOML)"
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="the new folder")
    found = parser.parse_args(argv)
    source = shipped_protocol(found.protocol) if found.protocol in SHIPPED else Path(found.protocol)
    if not source.is_file():
        raise ConfigError(
            f"{found.protocol!r} is no protocol: say {', '.join(SHIPPED)}, or name a file"
        )
    study = make_study(
        found.folder, source.read_bytes(), str(source), version(), SystemClock()
    )  # fmt: skip
    print(
        f"{study.folder}: {study.protocol.title}\n"
        f"next: put the consent that your ethics board approved into {study.folder / PROTOCOL},\n"
        f"then `riposte study check {study.folder}` and `riposte study allocate {study.folder} "
        f"--people {study.protocol.people} --seed S`"
    )
    return 0
