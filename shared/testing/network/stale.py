"""Finding and removing the namespaces of processes that are gone.

Every name begins with the id and the start time of the process that made it, so that whoever makes
hosts next can tell what a killed one left behind, even where its id is in use again.
"""

import contextlib
import os
import re
import shutil
import signal
from pathlib import Path

from shared.testing.network.commands import run

NAMESPACES = Path("/run/netns")
SHARED_MEMORY = Path("/dev/shm")
_NAME = re.compile(r"riposte-(?P<pid>[0-9]+)-(?P<started>[0-9]+)-.+")


def prefix() -> str:
    """Return how the names begin that this process may give."""
    return f"riposte-{os.getpid()}-{_started(os.getpid())}-"


def remove(namespace: str) -> None:
    """End what runs in a namespace and remove it, its links and its shared memory; idempotent."""
    if (NAMESPACES / namespace).exists():
        for pid in run("ip", "netns", "pids", namespace).split():
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(pid), signal.SIGKILL)
        run("ip", "netns", "delete", namespace)
    shutil.rmtree(SHARED_MEMORY / namespace, ignore_errors=True)


def remove_stale() -> list[str]:
    """Remove what processes that are gone have left; return the names."""
    found = {path.name for folder in (NAMESPACES, SHARED_MEMORY) for path in folder.glob("rip*-*")}
    stale = sorted(name for name in found if _is_stale(name))
    for name in stale:
        remove(name)
    return stale


def _is_stale(name: str) -> bool:
    match = _NAME.fullmatch(name)
    return match is not None and match["started"] != _started(int(match["pid"]))


def _started(pid: int) -> str:
    """Return when a process started (clock ticks since boot); empty when there is none."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8")
    except OSError:
        return ""
    return text.rpartition(")")[2].split()[19]  # the name before may hold spaces and brackets
