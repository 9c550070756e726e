"""``python -m tests.fuzz``: a million hostile inputs, and a table of what came of them."""

import argparse
import dataclasses
import functools
import importlib.util
import subprocess
import sys
from pathlib import Path
from typing import Any

import msgspec

from tests.fuzz.campaign import Plan, Progress, both, run, save_faults
from tests.fuzz.order import Engine
from tests.fuzz.registry import ALL, GROUPS, Group, targets_of
from tests.fuzz.target import MIB

MILLION = 1_000_000
SHARE = 0.1
"""Of the inputs that each of hypothesis and coverage reads."""
LEAST_GUIDED = 500
"""Inputs of a target from which coverage learns something."""


@dataclasses.dataclass(frozen=True)
class Part:
    """What one engine did of a group."""

    group: str
    engine: Engine
    progress: Progress


def table(parts: list[Part]) -> str:
    """Return what came of each group, as Markdown."""
    lines = [
        "| entrances | inputs | of them by hypothesis | by coverage | refused | accepted "
        "| slowest, ms CPU | memory, MiB | defects |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    rows = {group.name: [part for part in parts if part.group == group.name] for group in GROUPS}
    for group in GROUPS:
        if own := rows[group.name]:
            found = functools.reduce(both, (part.progress for part in own))
            tallies = found.tallies.values()
            slowest = 1e3 * max((each.seconds for each in tallies), default=0.0)
            memory = max((each.memory for each in tallies), default=0) / MIB
            lines.append(
                f"| {group.about} ({len(found.tallies)}) | {_counts(own)} | {slowest:.0f} | "
                f"{memory:.1f} | {len(found.faults)} |"
            )
    defects = sum(len(part.progress.faults) for part in parts)
    lines.append(f"| all | {_counts(parts)} | | | {defects} |")
    return "\n".join(lines) + "\n"


def _counts(parts: list[Part]) -> str:
    """Return the cells of what was read, by whose dice, and what came of it."""

    def inputs(*engines: Engine) -> int:
        return sum(
            each.inputs
            for part in parts
            if part.engine in engines
            for each in part.progress.tallies.values()
        )

    everything = inputs("mutate", "hypothesis", "atheris")
    accepted = sum(each.accepted for part in parts for each in part.progress.tallies.values())
    defects = sum(len(part.progress.faults) for part in parts)
    cells = (everything, inputs("hypothesis"), inputs("atheris"), everything - accepted - defects,
             accepted)  # fmt: skip
    return " | ".join(f"{each:,}" for each in cells)


def plans(group: Group, inputs: int, seed: int, folder: Path, names: list[str]) -> list[Plan]:
    """Return who reads the inputs of a group: coverage and hypothesis a tenth each.

    Args:
        group: the group.
        inputs: of all engines.
        seed: of the campaign.
        folder: of what is kept.
        names: of the group's targets. Coverage looks at one target in a process, and is given at
            least ``LEAST_GUIDED`` inputs of it: of few inputs few targets get any.
    """
    by_hypothesis = round(inputs * SHARE)
    guided: list[Plan] = []
    if importlib.util.find_spec("atheris") is not None:
        chosen = min(len(names), round(inputs * SHARE) // LEAST_GUIDED)
        for which in range(chosen):
            name = names[(seed + which * len(names) // chosen) % len(names)]
            share = round(inputs * SHARE) // chosen
            guided.append(Plan(group.name, share, seed, folder, "atheris", only=name))
    rest = inputs - by_hypothesis - sum(plan.inputs for plan in guided)
    made = [Plan(group.name, rest, seed, folder)]
    if by_hypothesis:
        made.append(Plan(group.name, by_hypothesis, seed, folder, "hypothesis"))
    return made + guided


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
    commit = subprocess.run(
        ["git", "describe", "--always", "--dirty"], capture_output=True, text=True, check=False
    ).stdout.strip()  # fmt: skip
    folder = given.out / f"{commit or 'unknown'}-seed-{given.seed}"
    parts: list[Part] = []
    if given.atheris:
        group = given.atheris.partition("/")[0]
        plan = Plan(group, given.inputs, given.seed, folder, "atheris", only=given.atheris)
        parts.append(Part(group, "atheris", run(plan)))
    for each in GROUPS if not given.atheris else ():
        if given.group in (None, each.name):
            share = each.inputs if given.group is None else MILLION
            inputs = max(1, share * given.inputs // MILLION)
            names = [one.name for one in targets_of(each.name, folder / "targets")]
            todo = plans(each, inputs, given.seed, folder, names)
            parts += [Part(each.name, plan.engine, run(plan)) for plan in todo]
    made = table(parts)
    say(f"{made}\ncommit {commit}, seed {given.seed}")
    (folder / "table.md").write_text(made, encoding="utf-8")
    faults = [
        path
        for part in parts
        for path in save_faults(part.progress, folder / "faults" / part.engine)
    ]
    for path in faults:
        story = msgspec.json.decode(path.with_suffix(".json").read_bytes(), type=dict[str, Any])
        say(f"{path}: {story['why'][:200]}")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
