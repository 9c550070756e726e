"""`riposte study check`: checks a protocol and its players, or a study with all its data."""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

from services.jobs.study.players import seats_of
from shared.study.checking import Remark, protocol_remarks, study_remarks
from shared.study.folder import open_study
from shared.study.protocol_file import SHIPPED, load_protocol, shipped_protocol

EXIT_PROBLEMS = 1


def main(argv: Sequence[str]) -> int:
    """Run ``riposte study check``; return 1 where something of the data is wrong."""
    parser = argparse.ArgumentParser(prog="riposte study check", description=__doc__)
    parser.add_argument(
        "what", metavar="PROTOCOL|DIR",
        help=f"a protocol's file, {', '.join(SHIPPED)}, or a study's folder",
    )  # fmt: skip
    parser.add_argument(
        "--site", type=Path, metavar="SITE", help="site file by which the players must fit"
    )
    found = parser.parse_args(argv)
    remarks = list(_remarks(found.what, found.site))
    for remark in remarks:
        print(f"{remark.level:<6}{remark.text}")
    return EXIT_PROBLEMS if any(remark.level == "error" for remark in remarks) else 0


def _remarks(what: str, site: Path | None) -> Iterator[Remark]:
    path = shipped_protocol(what) if what in SHIPPED else Path(what)
    study = open_study(path) if path.is_dir() else None
    protocol = study.protocol if study is not None else load_protocol(path)
    yield from protocol_remarks(protocol)
    for name, seat in seats_of(protocol, site).items():
        yield Remark("ok", f"player {name}: {seat.reference}")
    if study is not None:
        yield from study_remarks(study)
