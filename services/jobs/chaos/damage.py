"""Faults of the disk: a checkpoint with wrong bytes, no room for the ledger."""

import contextlib
import os
import shutil
import signal
import subprocess
from pathlib import Path

from services.jobs.chaos.faults import UP_SECONDS, Blow, Chance, Fault
from services.jobs.chaos.job import Job, JobEnded
from services.jobs.chaos.signals import send
from shared.errors import RiposteError

DISK_MIB = 320
"""A run asks for 256 MiB to begin with."""
END_SECONDS = 60.0
"""Longest wait for a run on a full disk to end."""
EXIT_NO_SPACE = 2


def corrupt_checkpoint(job: Job, chance: Chance) -> Blow:
    """Kill the learner and change bytes of its newest checkpoint before it is back."""
    name = job.learner
    pid = job.until(lambda: job.is_up(name) and job.pid(name), UP_SECONDS)
    told = job.events.get(name, []).count("checkpoint_corrupt")
    at = job.clock.now()
    if pid is not None:
        send(pid, signal.SIGKILL)
    folder = job.folder / "learner" / name.removeprefix("learner-")
    newest = max(folder.glob("checkpoint-*.safetensors"))
    where = flip_bytes(newest, chance)
    is_up = job.until(lambda: job.is_up(name, but=pid), UP_SECONDS)
    back = job.clock.now() if is_up else None
    refused = job.events.get(name, []).count("checkpoint_corrupt") - told
    return Blow(
        name, at, at, back, note=f"{newest.name}: {where}",
        told={"corrupt checkpoint": 1}, refused={"corrupt checkpoint": refused},
    )  # fmt: skip


def flip_bytes(path: Path, chance: Chance) -> str:
    """Change up to eight bytes of a file in place; return where."""
    payload = bytearray(path.read_bytes())
    places = sorted(int(at) for at in chance.generator.integers(0, len(payload), 8))
    for at in places:
        payload[at] ^= int(chance.generator.integers(1, 256))
    with path.open("r+b") as file:  # in place, as a bad disk does it
        file.write(payload)
    return f"bytes {', '.join(map(str, places))} of {len(payload)}"


def fill_disk(job: Job, _chance: Chance) -> Blow:
    """Leave no room on the disk of the ledger, and free it when the run has ended of it."""
    at = job.clock.now()
    filler = job.folder.parent / "filler"
    fill(filler)
    try:
        with contextlib.suppress(JobEnded):
            job.rest(END_SECONDS)
    finally:
        filler.unlink()
    code = job.exit_code
    over = job.clock.now()
    if code is None:
        return Blow("league-0", at, over, over, note="went on")
    note = f"the run ended with exit code {code} and was resumed"
    if code != EXIT_NO_SPACE:
        raise RiposteError(f"a run on a full disk ended with exit code {code}, expected 2")
    job.start(resume=True)
    is_up = job.until(lambda: job.is_up(job.learner, but=None), UP_SECONDS)
    return Blow("league-0", at, over, job.clock.now() if is_up else None, note=note)


def fill(path: Path) -> None:
    """Leave no room on the disk of this path."""
    for size in (1 << 20, 4096):
        with path.open("ab", buffering=0) as file, contextlib.suppress(OSError):
            while True:
                file.write(b"\0" * size)


def why_no_disk() -> str:
    """Return why a small disk cannot be had; empty when it can."""
    if shutil.which("mount") is None:
        return "needs the program `mount`"
    words = ("unshare", "--mount", "mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", "/mnt")
    found = subprocess.run(words, capture_output=True, text=True)
    return f"needs root's right to mount: {found.stderr.strip()}" if found.returncode else ""


def mount_disk(folder: Path) -> None:
    """Put a small disk under a folder.

    Raises:
        RiposteError: it is refused; ask ``why_no_disk`` first.
    """
    folder.mkdir(parents=True, exist_ok=True)
    if os.path.ismount(folder):
        return
    command = ["mount", "-t", "tmpfs", "-o", f"size={DISK_MIB}m", "tmpfs", str(folder)]
    found = subprocess.run(command, capture_output=True, text=True)
    if found.returncode:
        raise RiposteError(f"no small disk can be mounted on {folder}: {found.stderr.strip()}")


def unmount_disk(folder: Path) -> None:
    """Take it away again; what is still open on it lives until it is closed."""
    if os.path.ismount(folder):
        subprocess.run(["umount", "--lazy", str(folder)], check=True, capture_output=True)


FAULTS: tuple[Fault[Job], ...] = (
    Fault(
        "corrupt-checkpoint", "kill -9, and 8 bytes of its newest checkpoint changed",
        "the learner that learns", corrupt_checkpoint,
    ),
    Fault(
        "disk-full", "no byte free; freed when the run has ended, which is resumed", "league",
        fill_disk, seconds=10.0,
    ),
)  # fmt: skip
