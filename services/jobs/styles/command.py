"""`riposte styles RUN`: how the protagonists of a run move, and the three to send to people.

Reads the bouts of `riposte tournament`; writes ``styles/styles.html`` and ``styles/styles.json``
into the run, and the bundle: the warm start and the selected three, ready to be played against.
"""

import argparse
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

import msgspec

from services.jobs.runs import state_of
from services.jobs.styles.page import draw, styles_page
from services.jobs.styles.summary import (
    WARM_START,
    PolicyStyle,
    SeparabilityNote,
    StylesSummary,
    analyse,
    cast_of,
)
from services.jobs.tournament.words import aligned
from services.league.snapshots import SnapshotStore
from shared.errors import RiposteError
from shared.policy.snapshot import digest_of, unpack
from shared.runtime.build import commit
from shared.runtime.files import atomic_write
from shared.styles.bouts import load
from shared.styles.bundle import Bundle, BundlePlayer, save_bundle
from shared.styles.components import GOAL, KEPT
from shared.styles.features import FEATURES

BOUTS = Path("tournament") / "bouts.parquet"
STYLES = "styles"
BUNDLE = "bundle"
PLUS_MINUS = "\N{PLUS-MINUS SIGN}"


def main(argv: Sequence[str]) -> int:
    """Run ``riposte styles``; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="riposte styles",
        description="Measure how a run's protagonists move, select the three most separable, and "
        "write a page, its numbers and the bundle to play against.",
    )
    parser.add_argument(
        "run", nargs="?", type=Path, default=Path("runs/latest"), metavar="RUN",
        help="folder of the run (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON")
    found = parser.parse_args(argv)
    summary = write_styles(found.run)
    if found.json:
        print(msgspec.json.encode(summary).decode())
    else:
        print(styles_text(summary, found.run))
    return 0


def write_styles(folder: Path) -> StylesSummary:
    """Write styles and bundle of a run whose tournament has been played; return the numbers.

    Raises:
        RiposteError: there is no run or no tournament, it is incomplete, there are too few
            protagonists, or the files cannot be written; nothing is left half-written.
    """
    state = state_of(folder)
    table = load(folder / BOUTS)
    cast = cast_of(state, table)
    analysis = analyse(
        cast,
        table,
        seed=state.seed,
        trained_by=trained_by(folder),
        selected_by=shlex.join(["riposte", "styles", _place(folder)]),
        commit=commit(),
    )
    summary = analysis.summary
    if cast.warm_start is None:
        raise RiposteError("this run has no warm-start pair; train phase one to its end first")
    bundle, payloads = _bundle(summary, cast.warm_start, SnapshotStore(folder / "snapshots"))
    page = styles_page(summary, draw(analysis), bundle)
    try:
        (folder / STYLES).mkdir(exist_ok=True)
    except OSError as error:
        raise RiposteError(f"cannot make {folder / STYLES}: {error.strerror}") from error
    indented = msgspec.json.format(msgspec.json.encode(summary), indent=1)
    atomic_write(folder / STYLES / "styles.json", indented)
    atomic_write(folder / STYLES / "styles.html", page.encode())
    save_bundle(folder / BUNDLE, bundle, payloads)
    return summary


def _place(folder: Path) -> str:
    """Return a folder as others can read it: from here, or its last name."""
    whole, here = folder.resolve(), Path.cwd()
    return str(whole.relative_to(here)) if whole.is_relative_to(here) else whole.name


def trained_by(folder: Path) -> str:
    """Return the command line that made a run, or one that trains such a run.

    Without the paths of this machine.
    """
    try:
        known = msgspec.json.decode((folder / "summary.json").read_bytes(), type=dict[str, object])
        command = msgspec.convert(known["origin"], dict[str, object])["command"]
    except (OSError, ValueError, RecursionError, KeyError):
        command = ""
    config = f"{_place(folder)}/config.toml"
    again = ["riposte", "train", config, "--phase", "all", "--out", "AGAIN"]
    if not isinstance(command, str) or not command:
        return shlex.join(again)
    return re.sub(r"(?<![^\s=])/[^\s'\"]+", lambda found: _place(Path(found[0])), command)


def _bundle(
    summary: StylesSummary, warm_start: str, store: SnapshotStore
) -> tuple[Bundle, dict[str, bytes]]:
    """Return the bundle of the selected three and the warm start, and the files it holds."""
    payloads: dict[str, bytes] = {}
    players: list[BundlePlayer] = []

    def add(name: str, reference: str, style: PolicyStyle | None) -> None:
        digest = digest_of(reference)
        payloads[digest] = store.get(reference)
        names = [feature.name for feature in FEATURES]
        players.append(
            BundlePlayer(
                name=name,
                role="warm_start" if name == "warm-start" else "selected",
                round=style.round if style else 0,
                seed=unpack(payloads[digest], digest).card.seed,
                sha256=digest,
                style=dict(zip(names, style.mean, strict=True)) if style else {},
                spread=dict(zip(names, style.spread, strict=True)) if style else {},
            )
        )

    measured = {policy.label: policy for policy in summary.policies}
    add("warm-start", warm_start, measured.get(WARM_START))
    for number, policy in enumerate(summary.of_part("selected"), 1):
        add(f"style-{number}", policy.reference, policy)
    bundle = Bundle(
        run=summary.run,
        seed=summary.seed,
        trained_by=summary.trained_by,
        selected_by=summary.selected_by,
        commit=summary.commit,
        criterion=summary.criterion,
        criterion_value=summary.triples[0].smallest,
        bouts=summary.policies[0].bouts,
        players=tuple(players),
    )
    return bundle, payloads


def styles_text(summary: StylesSummary, folder: Path) -> str:
    """Return the numbers on one screen."""
    kept = summary.information[KEPT - 1]
    three = summary.triples[0]
    distance, styles = summary.distance, summary.effective_styles
    return "\n".join(
        [
            "",
            *_table(summary),
            "",
            f"kept      {kept:.1%} of what tells the policies apart, in {KEPT} components "
            f"(paper: at least {GOAL:.0%})",
            *([f"          {summary.why_not}"] if summary.why_not else []),
            f"selected  {', '.join(three.policies)}: at least {three.smallest:.1f} standard "
            "deviations apart",
            *_accuracy("of three", summary.selected_apart),
            *_accuracy(f"of all {len(summary.library)}", summary.library_apart),
            f"diversity {styles.value:.2f} [{styles.low:.2f}, {styles.high:.2f}] effective styles, "
            f"{distance.value:.2f} [{distance.low:.2f}, {distance.high:.2f}] apart on average",
            f"page      {folder / STYLES / 'styles.html'}",
            f"bundle    {folder / BUNDLE}",
        ]
    )


def _table(summary: StylesSummary) -> list[str]:
    """Return mean and standard deviation of each feature, a column a protagonist."""
    chosen = summary.triples[0].policies
    names = [f"{policy.label}{'*' * (policy.label in chosen)}" for policy in summary.policies]
    rows = [("", *names)]
    for k, feature in enumerate(summary.features):
        title = feature.title if feature.unit == "1" else f"{feature.title} ({feature.unit})"
        cells = (
            f"{policy.mean[k]:.3g} {PLUS_MINUS} {policy.spread[k]:.2g}"
            for policy in summary.policies
        )
        rows.append((title, *cells))
    scores = (f"{policy.score:+.0f}" for policy in summary.policies)
    rows.append(("points against", *scores))
    return aligned(rows)


def _accuracy(whom: str, found: SeparabilityNote) -> list[str]:
    known = found.random_folds
    text = f"{known.share:.1%} [{known.low:.1%}, {known.high:.1%}]"
    text += f" (by planes {found.linear.share:.1%})"
    if found.by_opponent is not None:
        unseen = found.by_opponent
        text += (
            f", against unseen opponents {unseen.share:.1%} [{unseen.low:.1%}, {unseen.high:.1%}]"
        )
    return [f"told apart {whom}: {text}; by chance {found.chance:.1%}"]
