"""A virtual environment for each peer, from its file of pinned requirements."""

import hashlib
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

from benchmarks.harness import ROOT

REQUIREMENTS = Path(__file__).parent / "requirements"
FOLDER = ROOT / "runs" / "peers"
INSTALL_SECONDS = 1800.0
READY = "ready"


class CannotInstallError(Exception):
    """A peer's environment could not be made; says why."""


def interpreter(name: str) -> Path:
    """Return the Python of a peer, its environment made first where that is not so yet.

    Args:
        name: of the file of requirements.

    Raises:
        CannotInstallError: pip failed; its last line.
    """
    wanted = REQUIREMENTS / f"{name}.txt"
    digest = hashlib.sha256(wanted.read_bytes()).hexdigest()[:12]
    folder = FOLDER / f"{name}-{digest}"
    python = folder / "bin" / "python"
    if (folder / READY).exists():
        return python
    shutil.rmtree(folder, ignore_errors=True)
    print(f"installing {name} into {folder}", file=sys.stderr, flush=True)
    venv.create(folder, with_pip=True)
    command = [python, "-m", "pip", "install", "--quiet", "--requirement", wanted]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, check=False, timeout=INSTALL_SECONDS
        )
    except subprocess.TimeoutExpired as error:
        raise CannotInstallError(f"pip took more than {INSTALL_SECONDS:g} s") from error
    if done.returncode:
        raise CannotInstallError(done.stderr.strip().splitlines()[-1])
    (folder / READY).touch()
    return python


def size_mib(python: Path) -> float:
    """Return what the environment of an interpreter takes on the disk (MiB)."""
    total = 0
    for folder, _, files in os.walk(python.parents[1]):
        total += sum(os.lstat(os.path.join(folder, name)).st_size for name in files)
    return total / 2**20
