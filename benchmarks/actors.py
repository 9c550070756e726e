"""What a second actor adds where the learner is not the limit: real runs whose learner has no PPO.

Router, league and learner are the real processes; the learner takes rollouts in, checks and
acknowledges them and writes versions, which teach nothing. Runs with one and with two actors by
turns, all processes on the same two cores, so that what the others need is part of the answer.
"""

from typing import Any

from benchmarks.harness import interleaved, median, on_first_cores
from benchmarks.training_run import ENDLESS, UNTAUGHT, training_run
from services.jobs.bench import Check, Measurement

QUESTION = "how many more samples two actors make than one where the learner is not the limit"
GOAL = 0.9
CORES = 2
ACTORS = (1, 2)


def run_once(actors: int, seconds: float) -> dict[str, Any]:
    """Return what a run with so many actors did between two versions."""
    words = (*ENDLESS, "train.record=false", f"train.actors={actors}")
    with training_run(words, wrap=UNTAUGHT, of="learner-") as run:
        window = run.window(seconds)
    spent = {name: used / window["wall_s"] for name, used in window["cpu_s_by_process"].items()}
    own = sum(used for name, used in spent.items() if name.startswith("actor-"))
    return {
        "samples_per_s": window["samples_per_s"],
        "actors": own,
        "others": sum(spent.values()) - own,
        "samples_per_actor_cpu_s": window["samples_per_s"] / own,
        "waited": window["delay_s"] / window["wall_s"],
    }


def measure(smoke: bool) -> Measurement:
    """Return two actors' samples a second over twice those of one."""
    seconds, rounds = (1.0, 1) if smoke else (15.0, 5)
    with on_first_cores(CORES):
        turns = interleaved(
            rounds, [lambda count=count: run_once(count, seconds) for count in ACTORS]
        )
    runs = tuple(
        {f"{name}, {count}": value for count, seen in zip(ACTORS, turn, strict=True)
         for name, value in seen.items()}
        | {"ratio": turn[1]["samples_per_s"] / (2.0 * turn[0]["samples_per_s"])}
        for turn in turns
    )  # fmt: skip
    return Measurement(
        value=median(runs, "samples_per_s, 2"),
        unit="samples/s with two actors",
        limit=2.0 * median(runs, "samples_per_s, 1"),
        ratio=Check(name="two actors / twice one", value=median(runs, "ratio"), goal=GOAL),
        runs=runs,
        checks=(
            Check(name="samples per CPU second of the actors, two / one",
                  value=median(runs, "samples_per_actor_cpu_s, 2")
                  / median(runs, "samples_per_actor_cpu_s, 1")),
            *(
                Check(name=f"{name}, {count}", value=median(runs, f"{key}, {count}"))
                for count in ACTORS
                for name, key in (
                    ("samples/s, actors", "samples_per_s"),
                    ("cores of the actors", "actors"),
                    ("cores of all others", "others"),
                    ("cores our processes waited for", "waited"),
                )
            ),
        ),
    )  # fmt: skip
