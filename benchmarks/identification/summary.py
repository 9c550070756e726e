"""What the kept records of the protocol say together: a picture, and tables for a document.

``python -m benchmarks.identification.summary docs/identify_results.md`` renews the tables between
their two markers, and the picture beside them.
"""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from benchmarks.harness import ROOT
from benchmarks.identification.judging import Judged, judged
from benchmarks.identification.running import finished
from benchmarks.identification.table import checks_of, confusion, curve, wilson
from services.jobs.bench import figure
from shared.messages.markdown import renew
from shared.telemetry.naming_figures import Outcome, Rate, naming

BEGIN: Final = "<!-- protocol:begin -->"
END: Final = "<!-- protocol:end -->"
KEPT: Final = tuple(
    ROOT / "benchmarks" / "identification" / name for name in ("records.jsonl", "series_2.jsonl")
)
PICTURE: Final = ROOT / "docs" / "images" / "identify_results.png"
LAST: Final = 100
"""Data sets that say what the code of today does: no code had seen them."""
_GOAL: Final = 0.9


def kept() -> list[dict[str, Any]]:
    """Return the records of all series."""
    return [record for path in KEPT for record in finished(path)]


def described(records: Sequence[dict[str, Any]]) -> str:
    """Return the goals and what was said of each effect, as Markdown tables."""
    last = records[-LAST:]
    rows = _rows(records)
    now = _rows(last)
    lines = [f"| Figure | Goal | All {len(records)} | The last {len(last)} |", "|---|---|---|---|"]
    lines += [f"| {name} | {goal} | {value} | {now.get((name, goal), '')} |"
              for (name, goal), value in rows.items()]  # fmt: skip
    lines += ["", "| Hidden | Named | Else |", "|---|---|---|"]
    for name, row in confusion(records).items():
        others = ", ".join(f"{said} {count}" for said, count in row.items() if said != name)
        count = sum(row.values())
        right = "" if name == "(nothing)" else f"{row.get(name, 0)} of {count}"
        lines.append(f"| {name} | {right} | {others} |")
    return "\n".join(lines)


def _rows(records: Sequence[dict[str, Any]]) -> dict[tuple[str, str], str]:
    """Return figures by name and goal, those that miss it bold, each with how many it is of."""
    found: dict[tuple[str, str], str] = {}
    for check in checks_of(records):
        if check.goal is None:
            continue
        name, _, count = check.name.partition(" (n = ")
        value = figure(check.value)
        if check.low is not None and check.high is not None:
            value += f" [{figure(check.low)}, {figure(check.high)}]"
        value = value if check.is_met else f"**{value}**"
        of = f", n = {count.removesuffix(')')}" if count else ""
        found[name, f"{check.goal_is} {check.goal:g}"] = value + of
    return found


def outcomes(records: Sequence[dict[str, Any]]) -> list[Outcome]:
    """Return what was said of each effect, the one that is named most of all first."""
    counts: dict[str, dict[str, int]] = {}
    for record in records:
        if "error" in record or record["cell"] != "single":
            continue
        found = judged(record)
        of_it = counts.setdefault(found.hidden[0], {})
        key = _key(found)
        of_it[key] = of_it.get(key, 0) + 1
    named = {name: row.get("right", 0) / sum(row.values()) for name, row in counts.items()}
    order = sorted(counts, key=lambda name: (-named[name], name))
    return [Outcome(name.replace("_", " "), counts[name]) for name in order]


def _key(found: Judged) -> str:
    if found.has_place:
        return "right"
    if found.has_tie and not found.has_effect:
        return "tie"
    return "no name" if found.said in ("(none)", "(unexplained)", "(base_too_coarse)") else "wrong"


def rates(records: Sequence[dict[str, Any]]) -> list[Rate]:
    """Return how often the right effect is named, by how much it takes off what the base leaves."""
    found: list[Rate] = []
    for each in curve(records):
        count = round(each["n"])
        interval = wilson(round(each["named"] * count), count)
        found.append(Rate(each["from"], each["to"], each["named"], interval, count))
    return found


def main(argv: Sequence[str] | None = None) -> int:
    """Renew the tables in a document, and the picture; return the exit code."""
    words = sys.argv[1:] if argv is None else argv
    if len(words) != 1:
        sys.stderr.write("usage: python -m benchmarks.identification.summary FILE\n")
        return 2
    records = kept()
    if not renew(Path(words[0]), BEGIN, END, described(records)):
        return 2
    try:
        PICTURE.write_bytes(naming(outcomes(records), rates(records), _GOAL))
    except OSError as error:
        sys.stderr.write(f"{PICTURE}: {error.strerror}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
