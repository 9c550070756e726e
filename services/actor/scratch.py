"""The folder of an actor that joined, and those of actors that did not come to remove theirs."""

import contextlib
import os
import shutil
import tempfile
from pathlib import Path

from shared.errors import RiposteError
from shared.runtime.files import RunLock

PREFIX = "riposte-actor-"
_UNLOCKED = "riposte-joining-"


class Scratch:
    """A folder in ``TMPDIR`` that is locked for as long as its process lives."""

    def __init__(self) -> None:
        """Make it; it has its name from the moment it is locked.

        Raises:
            RiposteError: it cannot be written to.
        """
        made = Path(tempfile.mkdtemp(prefix=_UNLOCKED))
        self._lock = RunLock(made)
        self.path = made.with_name(PREFIX + made.name.removeprefix(_UNLOCKED))
        made.rename(self.path)

    def remove(self) -> None:
        """Remove it and all that is in it."""
        shutil.rmtree(self.path, ignore_errors=True)
        self._lock.close()


def remove_stale() -> None:
    """Remove the folders whose processes are gone, but for the newest: its log may say why."""
    found = [path for path in Path(tempfile.gettempdir()).glob(f"{PREFIX}*") if _is_ours(path)]
    kept = 0
    for path in sorted(found, key=_age_ns):
        with contextlib.suppress(RiposteError), RunLock(path):  # in use: not ours to judge
            if kept:
                shutil.rmtree(path, ignore_errors=True)
            kept += 1


def _is_ours(path: Path) -> bool:
    """Return whether a folder is one that ``Scratch`` made for this user."""
    try:
        own = path.stat(follow_symlinks=False).st_uid == os.getuid()
        return own and path.is_dir() and not path.is_symlink() and (path / "lock").is_file()
    except OSError:
        return False


def _age_ns(path: Path) -> int:
    try:
        return -path.stat().st_mtime_ns
    except OSError:  # somebody else has removed it
        return 0
