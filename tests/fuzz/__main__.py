"""``python -m tests.fuzz``: a million hostile inputs, and a table of what came of them."""

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Any

import msgspec

from tests.fuzz.campaign import Plan, Progress, run, save_faults
from tests.fuzz.registry import ALL, GROUPS, targets_of
from tests.fuzz.target import MIB

MILLION = 1_000_000


def table(found: dict[str, Progress]) -> str:
    """Return what came of each group, as Markdown."""
    lines = [
        "| entrances | inputs | refused | accepted | slowest, ms CPU | memory, MiB | defects |",
        "|---|---|---|---|---|---|---|",
    ]
    totals = [0, 0, 0]
    about = {group.name: group.about for group in GROUPS}
    for name, progress in found.items():
        tallies = progress.tallies.values()
        inputs = sum(each.inputs for each in tallies)
        accepted = sum(each.accepted for each in tallies)
        defects = len(progress.faults)
        totals = [totals[0] + inputs, totals[1] + accepted, totals[2] + defects]
        seconds = max((each.seconds for each in tallies), default=0.0)
        memory = max((each.memory for each in tallies), default=0)
        lines.append(
            f"| {about[name]} ({len(progress.tallies)}) | {inputs:,} | "
            f"{inputs - accepted - defects:,} | {accepted:,} | {1e3 * seconds:.0f} | "
            f"{memory / MIB:.1f} | {defects} |"
        )
    inputs, accepted, defects = totals
    lines.append(f"| all | {inputs:,} | {inputs - accepted - defects:,} | {accepted:,} | | | "
                 f"{defects} |")  # fmt: skip
    return "\n".join(lines) + "\n"


def main(words: list[str]) -> int:
    """Run a campaign, or one target coverage-guided; returns 1 where a promise was broken."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("runs/fuzz"), help="(%(default)s)")
    parser.add_argument("--inputs", type=int, default=MILLION, help="of all groups (%(default)s)")
    parser.add_argument("--seed", type=int, default=1, help="(%(default)s)")
    parser.add_argument("--group", choices=[each.name for each in GROUPS], help="this one only")
    parser.add_argument(
        "--atheris", metavar="TARGET", help="coverage-guided, of one target: wire/Rollout, ..."
    )
    parser.add_argument("--list", action="store_true", help="the names of all targets")
    given = parser.parse_args(words)
    say = print
    if given.list:
        for each in targets_of(ALL, given.out / "list"):
            say(each.name)
        return 0
    found: dict[str, Progress] = {}
    folder = given.out / f"seed-{given.seed}"
    if given.atheris:
        group = given.atheris.partition("/")[0]
        plan = Plan(group, given.inputs, given.seed, folder, "atheris", only=given.atheris)
        found[group] = run(plan)
    for each in GROUPS if not given.atheris else ():
        if given.group in (None, each.name):
            share = each.inputs if given.group is None else MILLION
            inputs = max(1, share * given.inputs // MILLION)
            found[each.name] = run(Plan(each.name, inputs, given.seed, folder))
    made = table(found)
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    ).stdout.strip()
    say(f"{made}\ncommit {commit}, seed {given.seed}")
    (folder / "table.md").write_text(made, encoding="utf-8")
    faults = [path for each in found.values() for path in save_faults(each, given.out / "faults")]
    for path in faults:
        story = msgspec.json.decode(path.with_suffix(".json").read_bytes(), type=dict[str, Any])
        say(f"{path}: {story['why'][:200]}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
