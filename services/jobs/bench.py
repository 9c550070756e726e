"""`riposte bench`: runs one script of the checkout's ``benchmarks/`` and says how near the limit.

A script has ``QUESTION``, one line, and ``measure(smoke: bool) -> Measurement``. What the figures
were measured against is measured in the same run, so that they mean something elsewhere.
"""

import argparse
import ast
import datetime
import importlib
import os
import platform
import sys
import time
from collections.abc import Callable, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, Literal, Protocol, cast

import msgspec

from services.jobs.doctor.machine import processor
from shared.config.site import nearest
from shared.errors import ConfigError, RiposteError
from shared.runtime.build import SOURCE_ROOT, commit

QUIET_LOAD = 0.5
"""Load average per core above which a row says that the machine was busy."""
RESULTS = "RESULTS.md"
PICTURE = Path("docs", "images", "benchmarks.png")
"""Of the table, in the checkout."""
TABLE_HEAD = """# Measured

A row is what one command printed on one machine; `riposte bench NAME --write` and
`python -m benchmarks.learning ... --write` add rows. Both sides of a ratio were measured in the
same run, in turns. In brackets: smallest to largest over the rounds, or, as [low, high], a 95 %
interval over seeds. A load beside the number of cores says whether the machine was quiet.

| Date | Benchmark | Figure of the goal | Against the limit | Also | Machine | Command | Commit |
|---|---|---|---|---|---|---|---|
"""
PACKAGES = ("mujoco", "mujoco-warp", "numpy", "torch", "rsl-rl-lib", "eclipse-zenoh")
"""Whose versions stand in a row."""


class NotHereError(RiposteError):
    """What a benchmark is about is not on this machine; says what."""


class Check(msgspec.Struct, frozen=True, kw_only=True):
    """One figure and what is asked of it."""

    name: str
    value: float
    unit: str = ""
    goal: float | None = None
    """None: only shown."""
    goal_is: Literal["at least", "at most"] = "at least"
    low: float | None = None
    """95 % interval of the value, where it is the mean of several seeds."""
    high: float | None = None

    @property
    def is_met(self) -> bool:
        """Return whether the goal is reached; True where there is none."""
        if self.goal is None:
            return True
        return self.value >= self.goal if self.goal_is == "at least" else self.value <= self.goal


class Measurement(msgspec.Struct, frozen=True, kw_only=True):
    """What one benchmark found."""

    value: float
    unit: str
    limit: float
    """What ``value`` was measured against in the same run, in the same unit."""
    ratio: Check
    """The figure the goal speaks of."""
    runs: tuple[dict[str, Any], ...]
    """One entry a round, in the order they were made."""
    checks: tuple[Check, ...] = ()
    """Further figures."""
    details: dict[str, Any] = {}


class Machine(msgspec.Struct, frozen=True, kw_only=True):
    """Where and on what it was measured."""

    name: str
    cores: int
    python: str
    versions: dict[str, str]
    load_before: tuple[float, float, float]
    load_after: tuple[float, float, float]

    @property
    def is_quiet(self) -> bool:
        """Return whether nothing else was going on when it began."""
        return self.load_before[0] <= QUIET_LOAD * self.cores


class Script(Protocol):
    """A module in ``benchmarks/`` that can be run by name."""

    QUESTION: str

    def measure(self, smoke: bool) -> Measurement:
        """Return what was measured; ``smoke`` takes seconds and its figures mean nothing."""
        ...


def main(argv: Sequence[str]) -> int:
    """Run ``riposte bench``; return 1 when a goal is missed in earnest."""
    parser = argparse.ArgumentParser(prog="riposte bench", description=__doc__)
    parser.add_argument("name", nargs="?", metavar="NAME", help="which; without it: the list")
    parser.add_argument("--smoke", action="store_true", help="a few seconds; figures mean nothing")
    parser.add_argument("--json", action="store_true", help="one JSON object")
    parser.add_argument("--write", action="store_true", help=f"add a row to benchmarks/{RESULTS}")
    found = parser.parse_args(argv)
    folder = benchmarks_folder()
    if found.name is None:
        questions = {name: question(folder / f"{name}.py") for name in names(folder)}
        if found.json:
            print(msgspec.json.encode(questions).decode())
        else:
            print("\n".join(f"{name:<10} {text}" for name, text in questions.items()))
        return 0
    if found.name not in names(folder):
        raise ConfigError(
            f"there is no benchmark {found.name!r}; {nearest(found.name, names(folder))}"
        )
    if found.smoke and found.write:
        raise ConfigError("--write keeps figures that mean something: leave --smoke out")
    try:
        report = run(found.name, smoke=found.smoke)
    except NotHereError as why:
        skipped = msgspec.json.encode({"name": found.name, "skipped": str(why)}).decode()
        print(skipped if found.json else f"{found.name} skipped: {why}")
        return 0
    print(msgspec.json.encode(report).decode() if found.json else text_of(report))
    if found.write:
        keep(report, f"riposte bench {found.name}")
    missed = not all(check["met"] for check in (report["goal"], *report["checks"]))
    return 1 if missed and not found.smoke else 0


def benchmarks_folder() -> Path:
    """Return the folder of the scripts.

    Raises:
        ConfigError: this is no checkout.
    """
    folder = SOURCE_ROOT / "benchmarks"
    if not (folder / "harness.py").is_file():
        raise ConfigError(
            f"benchmarks are part of the source, and {SOURCE_ROOT} has none: clone the "
            "repository, `make test` in it, and run its .venv/bin/riposte"
        )
    return folder


def names(folder: Path) -> list[str]:
    """Return the scripts that can be run by name."""
    return sorted(path.stem for path in folder.glob("*.py") if question(path))


def question(path: Path) -> str:
    """Return what a script answers, without running it; empty when it is no benchmark."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "QUESTION":
            return str(ast.literal_eval(node.value))
    return ""


def run(name: str, *, smoke: bool) -> dict[str, Any]:
    """Run a script and return the object that ``--json`` prints.

    Args:
        name: of the script.
        smoke: only see that it works.
    """
    sys.path.insert(0, str(SOURCE_ROOT))

    def measure() -> Measurement:
        return cast("Script", importlib.import_module(f"benchmarks.{name}")).measure(smoke)

    return report_of(name, measure, smoke=smoke)


def report_of(name: str, measure: Callable[[], Measurement], *, smoke: bool) -> dict[str, Any]:
    """Measure, and return the object that ``--json`` prints.

    Args:
        name: of what is measured.
        measure: does it.
        smoke: the figures mean nothing.
    """
    load_before, cores = os.getloadavg(), len(os.sched_getaffinity(0))
    cpu_before, began_at = _cpu_seconds(), time.perf_counter()
    found = measure()
    machine = msgspec.structs.replace(describe_machine(load_before), cores=cores)
    return {
        "name": name,
        "value": found.value,
        "unit": found.unit,
        "limit": found.limit,
        "ratio": found.ratio.value,
        "runs": list(found.runs),
        "cpu_s": _cpu_seconds() - cpu_before,
        "wall_s": time.perf_counter() - began_at,
        "commit": commit(),
        "smoke": smoke,
        "goal": _plain(found.ratio),
        "checks": [_plain(check) for check in found.checks],
        "details": found.details,
        "machine": msgspec.to_builtins(machine) | {"quiet": machine.is_quiet},
    }


def _plain(check: Check) -> dict[str, Any]:
    return msgspec.to_builtins(check) | {"met": check.is_met}


def _cpu_seconds() -> float:
    """Return the CPU seconds of this process and of its children that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def describe_machine(load_before: tuple[float, float, float]) -> Machine:
    """Return where this runs; call it right after the measurement."""
    versions: dict[str, str] = {}
    for package in PACKAGES:
        try:
            versions[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            continue
    return Machine(
        name=processor(),
        cores=len(os.sched_getaffinity(0)),
        python=platform.python_version(),
        versions=versions,
        load_before=load_before,
        load_after=os.getloadavg(),
    )


def text_of(report: dict[str, Any]) -> str:
    """Return a report as a person reads it."""
    machine = report["machine"]
    lines = [
        f"{report['name']}: {figure(report['value'])} {report['unit']}, "
        f"measured against {figure(report['limit'])}"
    ]
    for check in (report["goal"], *report["checks"]):
        mark = " " if check["goal"] is None else "✓" if check["met"] else "✗"
        wanted = "" if check["goal"] is None else f" (goal: {check['goal_is']} {check['goal']:g})"
        lines.append(f"  {mark} {check['name']:<52} {_value(check)}{wanted}")
    quiet = "quiet" if machine["quiet"] else "BUSY: measure again"
    lines.append(
        f"  {len(report['runs'])} rounds, {report['wall_s']:.0f} s, {report['cpu_s']:.0f} CPU s, "
        f"load {machine['load_before'][0]:.1f} before, {machine['load_after'][0]:.1f} after "
        f"({quiet}), commit {report['commit'] or 'unknown'}"
    )
    if report["smoke"]:
        lines.append("  smoke: it works; the figures mean nothing")
    return "\n".join(lines)


def figure(value: float) -> str:
    """Return a number with three to four digits that matter."""
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _value(check: dict[str, Any]) -> str:
    """Return a check's value with its interval and unit."""
    unit = f" {check['unit']}" if check["unit"] else ""
    if check["low"] is None:
        return f"{figure(check['value'])}{unit}"
    return f"{figure(check['value'])} [{figure(check['low'])}, {figure(check['high'])}]{unit}"


def keep(report: dict[str, Any], command: str) -> None:
    """Add what was measured to the checkout's table of results, and draw its picture anew.

    Args:
        report: of ``run``.
        command: that repeats it.
    """
    table = benchmarks_folder() / RESULTS
    add_row(table, report, command)
    importlib.import_module("benchmarks.picture").draw(table, SOURCE_ROOT / PICTURE)


def add_row(path: Path, report: dict[str, Any], command: str) -> None:
    """Add what was measured to the table of results; begin the table where there is none.

    Args:
        path: the table.
        report: of ``run``.
        command: that repeats it.
    """
    machine = report["machine"]
    ratios = [run["ratio"] for run in report["runs"] if "ratio" in run]
    spread = f" ({min(ratios):.3g} to {max(ratios):.3g}, n = {len(ratios)})" if ratios else ""
    checks = "; ".join(f"{check['name']} {_value(check)}" for check in report["checks"])
    versions = ", ".join(f"{name} {number}" for name, number in machine["versions"].items())
    goal = report["goal"]
    cells = (
        datetime.datetime.now(datetime.UTC).date().isoformat(),
        report["name"],
        f"**{_value(goal)}**{spread}, {goal['name']}; goal {goal['goal_is']} {goal['goal']:g}",
        f"{figure(report['value'])} against {figure(report['limit'])} {report['unit']}",
        checks,
        f"load {machine['load_before'][0]:.2f} to {machine['load_after'][0]:.2f}; "
        f"{machine['cores']} x {machine['name']}; Python {machine['python']}, {versions}",
        f"`{command}`",
        report["commit"],
    )
    is_new = not path.exists()
    with path.open("a", encoding="utf-8") as file:
        if is_new:
            file.write(TABLE_HEAD)
        file.write("| " + " | ".join(cell.replace("|", "/") for cell in cells) + " |\n")
