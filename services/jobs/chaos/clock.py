"""A wall clock that jumps for one process and for nobody else.

The processes of the job are started with a small library before all others (``LD_PRELOAD``) that
adds a number to what the kernel says the time of day is. The number lies in a file for each
process, mapped into it, so that it can be changed while the process runs. Nothing in Riposte knows
of it, Python and Zenoh alike see the step, and the monotonic clock is left alone: a time step on a
real machine does exactly that.
"""

import shutil
import struct
import subprocess
from pathlib import Path

from services.jobs.chaos.faults import UP_SECONDS, Blow, Chance, Fault
from services.jobs.chaos.job import Job
from services.jobs.chaos.signals import EVERYBODY

SOURCE = Path(__file__).with_name("wall_clock.c")
FOLDER_VARIABLE = "RIPOSTE_CHAOS_CLOCKS"
JUMPS_SECONDS = (-86_400.0, -3600.0, -30.0, 30.0, 3600.0, 86_400.0)
WATCH_SECONDS = 3.0
"""How long a job is watched after a jump before its rate is looked at."""


def environment(folder: Path) -> dict[str, str]:
    """Return what processes whose clock may jump must be started with; empty where none can.

    Args:
        folder: for the library and the clocks.
    """
    compiler = shutil.which("cc")
    if compiler is None:
        return {}
    clocks = folder / "clocks"
    clocks.mkdir(parents=True, exist_ok=True)
    library = folder / "wall_clock.so"
    command = [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(SOURCE), "-ldl"]
    if subprocess.run(command, capture_output=True).returncode:
        return {}
    return {"LD_PRELOAD": str(library.resolve()), FOLDER_VARIABLE: str(clocks.resolve())}


def step(folder: Path, pid: int, seconds: float) -> bool:
    """Move the wall clock of a process; return whether it has one that can be moved."""
    path = folder / "clocks" / str(pid)
    try:
        with path.open("r+b") as file:
            (before,) = struct.unpack("<q", file.read(8))
            file.seek(0)
            file.write(struct.pack("<q", before + round(seconds * 1e9)))
    except (FileNotFoundError, struct.error):
        return False
    return True


def _jump(job: Job, chance: Chance) -> Blow:
    name = chance.one_of(EVERYBODY)
    seconds = JUMPS_SECONDS[int(chance.generator.integers(len(JUMPS_SECONDS)))]
    pid = job.until(lambda: job.is_up(name) and job.pid(name), UP_SECONDS)
    at = job.clock.now()
    has_jumped = pid is not None and step(job.clocks, pid, seconds)
    job.rest(WATCH_SECONDS)
    back = at if has_jumped and job.is_up(name) else None
    is_same = job.pid(name) == pid
    note = f"{seconds:+g} s" + ("" if is_same else ", ended by itself")
    return Blow(name, at, at, back, note)


FAULTS: tuple[Fault[Job], ...] = (
    Fault(
        "clock-jump", "wall clock steps by 30 s, an hour or a day, forth or back",
        "any process of the run", _jump,
    ),
)  # fmt: skip
