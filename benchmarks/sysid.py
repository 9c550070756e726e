"""Seconds of one fit that our identification and `mujoco.sysid` can both do.

Five armatures of an arm from two seconds of torques and motion (`benchmarks/fits/arm.py`), sought
from 0.01 kg m^2 by both; a side that does not find them has no time. Naming causes, judging on
held-out motion and reporting are not in it, for `mujoco.sysid` has nothing like them.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.environments import interpreter
from benchmarks.fits.arm import ARMATURES, GUESS, JOINTS, arm, recorded
from benchmarks.harness import ROOT, interleaved, median
from services.jobs.bench import Check, Measurement
from studies.real_data.folders import recording, write

QUESTION = "CPU seconds of a fit that our identification and mujoco.sysid can both do"
GOAL = 1.0
ERROR = 0.01
"""Relative: a fit that is further off has not found them."""
SECONDS = 300.0


def prepare(folder: Path) -> None:
    """Write the motion, as a data set and as plain arrays."""
    times, torques, q, qd = recorded()
    other = recorded(later=0.7)
    np.savez(folder / "motion.npz", times=times, torques=torques, q=q, qd=qd)
    model = arm((GUESS,) * len(JOINTS))
    model.compile()
    trajectories = (
        recording("one", "train", times, q, qd, torques),
        recording("other", "test", times, other[2], other[3], other[1]),
    )
    notes = {"source": "simulated"}
    write(folder / "data", model.to_xml(), "torque", JOINTS, trajectories, notes)


def fitted(python: str, module: str, data: Path) -> dict[str, Any]:
    """Return the seconds of one side's fit.

    Raises:
        RuntimeError: it failed, or did not find the armatures.
    """
    done = subprocess.run(
        [python, "-m", f"benchmarks.fits.{module}", str(data)], capture_output=True, text=True,
        cwd=ROOT, env=os.environ | {"PYTHONPATH": str(ROOT)}, timeout=SECONDS, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(f"{module} failed: {done.stderr.strip().splitlines()[-1:]}")
    found = json.loads(done.stdout.splitlines()[-1])
    found["error"] = max(
        abs(value / true - 1.0) for value, true in zip(found["armatures"], ARMATURES, strict=True)
    )
    if found["error"] > ERROR:
        raise RuntimeError(f"{module} found {found['armatures']}, and {ARMATURES} are hidden")
    return found


def measure(smoke: bool) -> Measurement:
    """Return the seconds of both."""
    theirs = str(interpreter("sysid"))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder)
        turns = interleaved(
            1 if smoke else 9,
            [
                lambda: fitted(sys.executable, "ours", folder / "data"),
                lambda: fitted(theirs, "theirs", folder / "motion.npz"),
            ],
        )
    runs: tuple[dict[str, Any], ...] = tuple(
        {f"{side} {name}": figures[name] for side, figures in zip(("ours", "theirs"), turn,
         strict=True) for name in ("cpu_s", "wall_s", "error")}
        | {"ratio": turn[0]["cpu_s"] / turn[1]["cpu_s"]}
        for turn in turns
    )  # fmt: skip
    return Measurement(
        value=median(runs, "ours cpu_s"),
        unit="CPU s a fit",
        limit=median(runs, "theirs cpu_s"),
        ratio=Check(
            name="ours / mujoco.sysid's, CPU s", value=median(runs, "ratio"), goal=GOAL,
            goal_is="at most",
        ),
        runs=runs,
        checks=tuple(
            Check(name=f"{side}, {what}", value=median(runs, f"{side} {name}"), unit=unit)
            for side in ("ours", "theirs")
            for what, name, unit in (
                ("wall", "wall_s", "s"), ("largest relative error", "error", ""),
            )
        ),
    )  # fmt: skip
