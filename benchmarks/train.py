"""Training samples a second: the processes of a real run against rsl_rl's runner in one process.

Both train the antagonist against a frozen fresh protagonist, on two cores, with the same PPO. The
runner gets the number of worlds and of torch threads that suits it best; the run is what
`riposte train` starts, with its recorder, but with the live page off. Rounds are interleaved.
"""

import tempfile
from pathlib import Path
from typing import Any

from benchmarks.harness import interleaved, median, on_first_cores
from benchmarks.peer_loops.running import Peer, fresh_protagonist, run, work_of
from benchmarks.training_run import training_run
from services.jobs.bench import Check, Measurement
from services.jobs.settings import Settings

QUESTION = "training samples/s of a real run against rsl_rl's runner in one process, on two cores"
GOAL = 1.5
RUNNERS = tuple(
    Peer(
        name="rsl_rl's runner", module="rsl_rl_runner", num_envs=num_envs, threads=threads,
        physics_threads=physics_threads,
    )
    for num_envs, threads, physics_threads in (
        (128, 1, 1), (256, 1, 1), (512, 1, 1), (256, 2, 1), (256, 1, 2), (256, 2, 2), (512, 2, 2),
    )
)  # fmt: skip
"""Worlds, threads of torch and of the physics that the runner may choose from."""


def ours(seconds: float) -> dict[str, Any]:
    """Return how fast a real run trains."""
    with training_run() as run:
        return run.window(seconds)


def measure(smoke: bool) -> Measurement:
    """Return our training speed beside the best single process."""
    seconds, rounds = (1.0, 1) if smoke else (25.0, 4)
    settings = Settings.load(None)
    with on_first_cores(2), tempfile.TemporaryDirectory(prefix="riposte-train-") as folder:
        opponent = fresh_protagonist(settings, Path(folder) / "opponent.safetensors")

        def theirs(runner: Peer, seconds: float) -> dict[str, Any]:
            return run(runner, work_of(runner, settings, opponent, seconds))

        tried = [
            (runner, theirs(runner, min(seconds, 10.0)))
            for runner in RUNNERS[: 1 if smoke else None]
        ]
        best, _ = max(tried, key=lambda one: one[1]["samples_per_s"])
        pairs = interleaved(rounds, [lambda: theirs(best, seconds), lambda: ours(seconds)])
    runs = tuple(
        {
            "ratio": our["samples_per_s"] / their["samples_per_s"],
            "cpu_ratio": our["samples_per_cpu_s"] / their["samples_per_cpu_s"],
            "ours": our["samples_per_s"],
            "baseline": their["samples_per_s"],
            "ours_per_cpu_s": our["samples_per_cpu_s"],
            "baseline_per_cpu_s": their["samples_per_cpu_s"],
            "cores_busy": our["cpu_s"] / our["wall_s"],
            "cores_missed": our["delay_s"] / our["wall_s"],
            "ours_details": our,
            "baseline_details": their,
        }
        for their, our in pairs
    )
    return Measurement(
        value=median(runs, "ours"),
        unit="samples/s",
        limit=median(runs, "baseline"),
        ratio=Check(name="our samples/s / the baseline's", value=median(runs, "ratio"), goal=GOAL),
        runs=runs,
        checks=(
            Check(name="ours per CPU second", value=median(runs, "ours_per_cpu_s")),
            Check(name="baseline's per CPU second", value=median(runs, "baseline_per_cpu_s")),
            Check(name="cores kept busy by ours", value=median(runs, "cores_busy")),
            Check(name="cores our processes waited for", value=median(runs, "cores_missed")),
        ),
        details={"baselines_tried": [figures for _, figures in tried]},
    )  # fmt: skip
