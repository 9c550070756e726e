"""`riposte report RUN`: the HTML report and the machine-readable summary of a run.

Works on a finished run, a stopped one, and one that goes on.
"""

import argparse
import datetime
import os
import platform
import shlex
import sys
from collections.abc import Sequence
from importlib import metadata
from pathlib import Path

import msgspec
import numpy as np

from services.jobs import commands
from services.jobs.doctor.machine import processor
from services.jobs.report.page import Extras, report_page
from services.jobs.report.pictures import Picture, bout_pictures
from services.jobs.report.summarise import Facts, summarise
from services.jobs.report.summary import Origin, Summary
from services.jobs.report.words import summary_text
from services.jobs.reproduction.report import HTML, JSON
from services.jobs.reproduction.report import write as write_reproduction
from services.jobs.runs import state_of
from services.jobs.settings import Settings
from services.league.history import RunState, StageRecord
from shared.runtime.build import commit
from shared.runtime.files import atomic_write
from shared.telemetry.figures import Panel
from shared.telemetry.rrd import recordings

__all__ = ["main", "summary_text", "write_report"]

PACKAGES = (
    "riposte", "eclipse-zenoh", "matplotlib", "msgpack", "msgspec", "mujoco", "numpy",
    "rerun-sdk", "rsl-rl-lib", "safetensors", "torch",
)  # fmt: skip
SMOOTH = 5
"""Updates in the running mean of the throughput."""
FILES = {
    "report.html": "this page",
    "summary.json": "its numbers, for programs",
    HTML: "what matches the paper and what does not, over both phases",
    JSON: "its numbers, for programs",
    "league.sqlite": "the ledger: every version, bout, lease and incident",
    "snapshots": "every policy version, named by its hash",
    "learner": "checkpoints, to continue from",
    "config.toml": "the configuration, complete",
    commands.FILE: "the commands that made it, as they were typed",
    "logs": "what each process logged",
}


def main(argv: Sequence[str] | None = None) -> int:
    """Write the report of a run; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="riposte report", description="Write a run's report.html and summary.json."
    )
    parser.add_argument(
        "run", nargs="?", type=Path, default=Path("runs/latest"), metavar="RUN",
        help="folder of the run (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the summary as JSON")
    parser.add_argument(
        "--no-pictures", action="store_true", help="do not play a bout for pictures"
    )
    found = parser.parse_args(argv)
    summary = write_report(found.run, pictures=not found.no_pictures)
    if found.json:
        print(msgspec.json.encode(summary).decode())
    else:
        print(summary_text(summary))
    return 0


def write_report(folder: Path, *, pictures: bool = True) -> Summary:
    """Write ``report.html`` and ``summary.json`` of a run and return its summary.

    A run with rounds of phase two gets ``reproduction.html`` and ``reproduction.json``, too.

    Args:
        folder: of the run.
        pictures: play a bout with the last policies and show moments of it.

    Raises:
        RiposteError: there is no run, its ledger is damaged, or the files cannot be written.
    """
    state = state_of(folder)
    site = folder / "config.toml"
    settings = Settings.load(site if site.exists() else None)
    summary = summarise(state, _facts(folder, state, settings))
    write_reproduction(folder, summary, settings.to_toml())
    extras = Extras(
        pictures=_pictures(folder, state, settings) if pictures else (),
        panels=panels(state),
        config=settings.to_toml(),
        files=_files(folder),
    )
    indented = msgspec.json.format(msgspec.json.encode(summary), indent=1)
    atomic_write(folder / "summary.json", indented)
    atomic_write(folder / "report.html", report_page(summary, extras).encode())
    return summary


def panels(state: RunState) -> list[Panel]:
    """Return the plots of training health, a line for each stage."""
    wanted = (
        ("KL per update", "approx_kl", True),
        ("Clip fraction", "clip_fraction", True),
        ("Explained variance", "explained_variance", False),
        ("Policy lag (versions)", "policy_lag_mean", True),
        ("Standard deviation of actions", "action_std", True),
    )
    found = [
        Panel(title, [_line(state, stage, name) for stage in state.stages], zero)
        for title, name, zero in wanted
    ]
    rates = [_throughput(state, stage) for stage in state.stages]
    return [*found, Panel("Samples a second", rates, zero=True)]


def _line(
    state: RunState, stage: StageRecord, name: str
) -> tuple[str, Sequence[float], Sequence[float]]:
    made = [version for version in stage.versions if version.metrics is not None]
    minutes = [(version.at_ns - state.started_at_ns) / 60e9 for version in made]
    return stage.stage.agent, minutes, [float(getattr(v.metrics, name)) for v in made]


def _throughput(
    state: RunState, stage: StageRecord
) -> tuple[str, Sequence[float], Sequence[float]]:
    """Return samples a second over the last few updates, at each update but the first."""
    made = [(v.at_ns, v.metrics.samples) for v in stage.versions if v.metrics is not None]
    minutes: list[float] = []
    rates: list[float] = []
    for k in range(1, len(made)):
        first = max(0, k - SMOOTH)
        seconds = (made[k][0] - made[first][0]) / 1e9
        if seconds > 0:
            minutes.append((made[k][0] - state.started_at_ns) / 60e9)
            rates.append(float(np.sum([n for _, n in made[first + 1 : k + 1]])) / seconds)
    return stage.stage.agent, minutes, rates


def _facts(folder: Path, state: RunState, settings: Settings) -> Facts:
    started = datetime.datetime.fromtimestamp(state.started_at_ns / 1e9, datetime.UTC)
    origin = _earlier_origin(folder) or _origin(folder, state)
    if typed := commands.made_by(folder):
        origin = msgspec.structs.replace(origin, command=typed)
    return Facts(
        folder=str(folder),
        started_at=started.strftime("%Y-%m-%d %H:%M UTC"),
        rules=settings.game,
        control_timestep=settings.sim.control_timestep,
        origin=origin,
    )


def _earlier_origin(folder: Path) -> Origin | None:
    """Return what an earlier report of a finished run said made it: this machine may be another."""
    try:
        earlier = msgspec.json.decode((folder / "summary.json").read_bytes(), type=Summary)
    except (OSError, ValueError, RecursionError):
        return None
    return earlier.origin if earlier.finished else None


def _origin(folder: Path, state: RunState) -> Origin:
    serial = ["--serial"] if state.serial else []
    words = ["riposte", "train", str(folder / "config.toml"), *serial, "--out", "AGAIN"]
    return Origin(
        command=shlex.join(words),
        commit=commit(),
        packages={name: version for name in PACKAGES if (version := _version(name))},
        python=platform.python_version(),
        machine=f"{platform.machine()}, {processor()}, {len(os.sched_getaffinity(0))} cores",
    )


def _version(name: str) -> str:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return ""


def _pictures(folder: Path, state: RunState, settings: Settings) -> list[Picture]:
    ends = {agent: state.stage_ends(agent) for agent in ("antagonist", "protagonist")}
    if not ends["antagonist"]:
        return []
    antagonist = f"sha256:{ends['antagonist'][-1].end_snapshot}"
    protagonist = "scripted:static"
    if ends["protagonist"]:
        protagonist = f"sha256:{ends['protagonist'][-1].end_snapshot}"
    return bout_pictures(
        folder,
        (antagonist, protagonist),
        settings.sim,
        settings.game,
        settings.action,
        settings.train.seed,
    )


def _files(folder: Path) -> list[tuple[str, str]]:
    """Return what lies in the folder."""
    found = [(name, about) for name, about in FILES.items() if (folder / name).exists()]
    return found + [(path.name, "recording: riposte watch") for path in recordings(folder)]


if __name__ == "__main__":
    sys.exit(main())
