"""Hides effects in data sets and counts how often `riposte identify` names them.

The protocol is in ``identification/protocol.py``; every finished data set is a line of
``runs/identify-COMMIT.jsonl``, so that a second call goes on. All of it takes hours; a share, or
what is done in so many minutes: ``python -m benchmarks.identify --share 0.05 --minutes 30``, and
with ``--skip`` others than those that code was mended by, or with ``--series 2`` the same of data
sets that nobody has seen; ``--cells tie`` runs one part of it.
"""

import argparse
import shlex
import sys
import tempfile
from collections.abc import Collection
from pathlib import Path

from benchmarks.harness import ROOT
from benchmarks.identification.protocol import CELLS, protocol, smoke
from benchmarks.identification.running import PROCESSES, run
from benchmarks.identification.table import checks_of, confusion, confusion_text, curve
from services.jobs.bench import RESULTS, Check, Measurement, keep, report_of, text_of
from shared.errors import RiposteError
from shared.runtime.build import commit

QUESTION = "how often the hidden effect is named, and how often one that is not there"
BASELINES_EVERY = 7
"""Of the data sets; no multiple of 2, so that both arms are among them."""


def measure(smoke: bool) -> Measurement:
    """Return the table of the whole protocol."""
    if smoke:
        with tempfile.TemporaryDirectory() as folder:
            return measured(Path(folder) / "smoke.jsonl", share=0.0)
    return measured(default_path(), share=1.0)


def default_path() -> Path:
    """Return where the records of this commit are kept."""
    return ROOT / "runs" / f"identify-{commit() or 'unknown'}.jsonl"


def measured(
    path: Path, share: float, processes: int = PROCESSES, minutes: float | None = None,
    baselines_every: int = BASELINES_EVERY, skipped: int = 0, cells: Collection[str] = CELLS,
    series: int = 1,
) -> Measurement:  # fmt: skip
    """Run a share of the protocol, or go on with it; 0 is the smoke test.

    Args:
        path: of the records.
        share: of the protocol's numbers.
        processes: how many at once.
        minutes: after which no data set is begun; None for as long as it takes.
        baselines_every: on every so many data sets the baselines run, too; 0: on none.
        skipped: so many data sets of the order are left out.
        cells: what is run of the others.
        series: of the protocol's seeds.

    Raises:
        RiposteError: no data set, or of all cells none with one effect, was done in that time.
    """
    trials = protocol(share, series) if share else smoke()
    every = baselines_every if share else 0
    records = run(trials, path, every, processes, minutes, skipped, cells)
    first, *others = checks_of(records)
    is_of_effects = first.name.startswith("right effect")
    if not others or ("single" in cells and not is_of_effects):
        wanted = "data set with one effect" if "single" in cells else "data set"
        raise RiposteError(f"no {wanted} was done, of {len(records)}")
    others.append(Check(name=f"data sets done, of {len(trials)}", value=float(len(records))))
    print(confusion_text(records), file=sys.stderr)
    names = {check.name: check for check in others}
    baseline = next((names[name] for name in names if "all_at_once: right" in name), None)
    return Measurement(
        value=first.value,
        unit="share of hidden effects named" if is_of_effects else "share of data sets",
        limit=baseline.value if baseline else 0.0,
        ratio=first,
        runs=tuple(records),
        checks=tuple(others),
        details={"confusion": confusion(records), "by_share_of_the_residual": curve(records)},
    )


def main() -> int:
    """Run a share of the protocol and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--share", type=float, default=1.0, help="of the protocol's numbers (1)")
    parser.add_argument("--out", type=Path, default=default_path(), help="JSON lines (%(default)s)")
    parser.add_argument("--processes", type=int, default=PROCESSES, help="at once (%(default)s)")
    parser.add_argument("--minutes", type=float, help="after which no data set is begun")
    parser.add_argument(
        "--baselines-every", type=int, default=BASELINES_EVERY, metavar="N",
        help="data sets; slow on a PR2, 0 for none (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--skip", type=int, default=0, metavar="N",
        help="data sets of the order to leave out, which earlier rows are of (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--cells", nargs="+", choices=CELLS, default=CELLS, metavar="CELL",
        help=f"of the protocol: {', '.join(CELLS)} (all)",
    )  # fmt: skip
    parser.add_argument(
        "--series", type=int, default=1, metavar="N",
        help="of the protocol's seeds; 2 is of data sets that nobody has seen (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--write", action="store_true", help=f"add a row to benchmarks/{RESULTS}")
    found = parser.parse_args()
    if not 0.0 < found.share <= 1.0 or found.processes < 1:
        parser.error("--share is over 0 and at most 1, --processes at least 1")
    if found.minutes is not None and found.minutes <= 0.0:
        parser.error("--minutes is over 0")
    if found.baselines_every < 0:
        parser.error("--baselines-every is at least 0")
    if found.skip < 0:
        parser.error("--skip is at least 0")
    if found.series < 1:
        parser.error("--series is at least 1")

    def share() -> Measurement:
        return measured(
            found.out, found.share, found.processes, found.minutes, found.baselines_every,
            found.skip, found.cells, found.series,
        )  # fmt: skip

    try:
        report = report_of("identify", share, smoke=False)
    except RiposteError as error:
        print(f"benchmarks.identify: {error}", file=sys.stderr)
        return 2
    print(text_of(report))
    if found.write:
        words = [word for word in sys.argv[1:] if word != "--write"]
        keep(report, shlex.join(["python", "-m", "benchmarks.identify", *words, "--write"]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
