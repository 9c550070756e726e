"""Which source a process runs: for logs, reports and run folders."""

import functools
import subprocess
from pathlib import Path

SOURCE_ROOT = Path(__file__).resolve().parents[2]
"""Folder that holds ``services`` and ``shared``: a checkout, or site-packages."""


@functools.cache
def commit() -> str:
    """Return the short commit of the checkout, ``+`` after it when files differ; else empty."""
    if not (SOURCE_ROOT / ".git").exists():
        return ""
    name = _git("rev-parse", "--short=12", "HEAD")
    changed = _git("status", "--porcelain", "--untracked-files=no")
    return f"{name}+" if name and changed else name


def _git(*args: str) -> str:
    command = ["git", "-C", str(SOURCE_ROOT), "--no-optional-locks", *args]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=5.0, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
