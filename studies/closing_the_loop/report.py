"""Stage `report`: what was found, and what it was worth in play, as a table and a figure."""

from collections.abc import Callable

import msgspec

from shared.runtime.files import atomic_write
from shared.telemetry.gain_figures import Group, points_against
from studies.closing_the_loop.finding import verdict_of
from studies.closing_the_loop.gains import Estimate, Row, rows_of
from studies.closing_the_loop.playing import scores_of
from studies.closing_the_loop.protocol import CONDITIONS, Condition, Folders, Protocol

Say = Callable[[str], None]
LABELS: dict[Condition, str] = {
    "nominal": "nominal", "base_fit": "base fit", "extended": "extended",
}  # fmt: skip


def report(protocol: Protocol, folders: Folders, say: Say) -> None:
    """Write ``results.md``, ``results.png`` and ``results.json``, and print the first."""
    scores = scores_of(protocol, folders)
    rows = rows_of(scores, protocol.antagonists, protocol.hidden_seed)
    text = "\n".join([*_found(protocol, folders), "", *_table(protocol, rows)])
    atomic_write(folders.root / "results.md", f"{text}\n".encode())
    atomic_write(folders.root / "results.json", msgspec.json.encode(rows))
    groups = [
        Group(
            LABELS[each],
            [row.points[each].mean for row in rows],
            [row.points[each].low for row in rows],
            [row.points[each].high for row in rows],
            [*scores[each].mean(axis=2).T.tolist(), scores[each].mean(axis=(1, 2)).tolist()],
        )
        for each in CONDITIONS
    ]
    names = [row.antagonist for row in rows]
    atomic_write(folders.root / "results.png", points_against(names, groups))
    say(text)


def _found(protocol: Protocol, folders: Folders) -> list[str]:
    verdict = verdict_of(folders)
    lines = [
        f"Hidden: {1000 * protocol.delay:g} ms of command latency, damping and armature of each "
        f"joint off by up to {100 * protocol.spread:g} %.",
        f"Found ({verdict.verdict}): {verdict.sentence}",
    ]
    for cause in verdict.causes:
        where = f" ({cause.where})" if cause.where else ""
        lines.append(
            f"- {cause.effect}{where}: {cause.quantity} {cause.value:.4g} {cause.unit}, "
            f"95 % {cause.interval.low:.4g} to {cause.interval.high:.4g}"
        )
    return lines


def _table(protocol: Protocol, rows: list[Row]) -> list[str]:
    head = ["antagonist", *(LABELS[each] for each in CONDITIONS)]
    head += [f"{LABELS[each]}: fewer" for each in CONDITIONS[1:]]
    lines = [
        f"Antagonist's points a bout on the twin, {len(protocol.seeds)} seeds, {protocol.bouts} "
        "bouts of each pairing, 95 % intervals over seeds and bouts:",
        "",
        f"| {' | '.join(head)} |",
        f"|{'---|' * len(head)}",
    ]
    for row in rows:
        cells = [_cell(row.points[each]) for each in CONDITIONS]
        cells += [_cell(row.gains[each]) for each in CONDITIONS[1:]]
        lines.append(f"| {' | '.join([row.antagonist, *cells])} |")
    return lines


def _cell(found: Estimate) -> str:
    return f"{found.mean:.0f} ({found.low:.0f} to {found.high:.0f})"
