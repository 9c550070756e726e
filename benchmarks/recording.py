"""What recording a training run costs: off, on, with the live page, and with somebody watching.

Whoever watches is Rerun's own program, which takes both streams of the live page and writes them
away; its CPU is not counted, that of the recorder and of the page's server is. Rounds interleaved.
"""

import contextlib
import subprocess
import tempfile
import time
import urllib.parse
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil

from benchmarks.harness import cpu_seconds, interleaved, median
from benchmarks.training_run import ENDLESS, TrainingRun, training_run
from services.jobs.bench import Check, Measurement
from shared.bus.ports import LOOPBACK, free_port
from shared.errors import RiposteError
from shared.telemetry.door import read_live_view
from shared.telemetry.viewer import viewer_program

QUESTION = "which share of a training run's CPU seconds goes into recording it"
GOAL = 0.03
MODES = {
    "off": ("train.record=false",),
    "on": (),
    "live page": ("recorder.live=true", "recorder.web_port=0"),
    "watched": ("recorder.live=true", "recorder.web_port=0"),
}
VIEW_SECONDS = 60.0


def view_of(run: TrainingRun) -> tuple[int, list[str]]:
    """Return the pid of the live page's server and the addresses of its streams.

    Raises:
        RiposteError: there is no live page within a minute.
    """
    deadline = time.monotonic() + VIEW_SECONDS
    while (view := read_live_view(run.folder)) is None:
        if time.monotonic() > deadline:
            raise RiposteError(f"no live page within {VIEW_SECONDS:g} s")
        run.check()
        time.sleep(0.1)
    query = urllib.parse.urlsplit(view.page).query
    return view.pid, urllib.parse.parse_qs(query)["url"]


@contextlib.contextmanager
def watched(sources: list[str], folder: Path) -> Iterator[None]:
    """Take what a live page offers, until the block ends."""
    watchers = [
        subprocess.Popen(
            [str(viewer_program()), source, "--save", str(folder / f"{number}.rrd"),
             "--bind", LOOPBACK, "--port", str(free_port())],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )
        for number, source in enumerate(sources)
    ]  # fmt: skip
    try:
        yield
        if ended := [one.args for one in watchers if one.poll() is not None]:
            raise RiposteError(f"a watcher ended: {ended}")
    finally:
        for one in watchers:
            one.kill()
            one.wait()


def share(mode: str, seconds: float) -> dict[str, Any]:
    """Return what a run spent in a mode."""
    with contextlib.ExitStack() as stack:
        run = stack.enter_context(training_run((*ENDLESS, *MODES[mode])))
        server: list[int] = []
        if mode in ("live page", "watched"):
            pid, sources = view_of(run)
            server = [pid, *(child.pid for child in psutil.Process(pid).children(recursive=True))]
            if mode == "watched":
                folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
                stack.enter_context(watched(sources, folder))
        run.wait_for_version(4)
        before, began = cpu_seconds(server), time.monotonic()
        window = run.window(seconds)
        page = (cpu_seconds(server) - before) / (time.monotonic() - began) * window["wall_s"]
    recorder = window["cpu_s_by_process"].get("recorder-0", 0.0)
    others = window["cpu_s"] - recorder
    return {
        "share": (recorder + page) / (window["cpu_s"] + page),
        "samples_per_other_cpu_s": window["samples"] / others,
        "samples_per_s": window["samples_per_s"],
        "recorder_cpu_s": recorder,
        "page_cpu_s": page,
    }


def measure(smoke: bool) -> Measurement:
    """Return the share of recording in each mode."""
    seconds, rounds = (1.0, 1) if smoke else (25.0, 3)
    turns = interleaved(rounds, [lambda mode=mode: share(mode, seconds) for mode in MODES])
    runs: tuple[dict[str, Any], ...] = tuple(
        {
            f"{mode}, {name}": figures[name]
            for mode, figures in zip(MODES, turn, strict=True)
            for name in ("share", "samples_per_other_cpu_s", "samples_per_s")
        }
        for turn in turns
    )
    off = median(runs, "off, samples_per_other_cpu_s")
    return Measurement(
        value=median(runs, "on, share"),
        unit="of the CPU seconds of a run",
        limit=1.0,
        ratio=Check(
            name="recording / all CPU", value=median(runs, "on, share"), goal=GOAL,
            goal_is="at most",
        ),
        runs=runs,
        checks=(
            Check(name="nothing when off", value=median(runs, "off, share"), goal=0.0,
                  goal_is="at most"),
            Check(name="with the live page", value=median(runs, "live page, share"), goal=GOAL,
                  goal_is="at most"),
            Check(name="watched", value=median(runs, "watched, share"), goal=GOAL,
                  goal_is="at most"),
            *(
                Check(name=f"samples per CPU second of the others, {mode} / off",
                      value=median(runs, f"{mode}, samples_per_other_cpu_s") / off)
                for mode in MODES if mode != "off"
            ),
        ),
    )  # fmt: skip
