"""Files that are whole or not there, and a folder that belongs to one process."""

import contextlib
import errno
import fcntl
import os
import shutil
from pathlib import Path

from shared.errors import RiposteError

OUT_OF_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
MIB = 1 << 20


def atomic_write(
    path: str | os.PathLike[str], data: bytes | bytearray | memoryview, mode: int | None = None
) -> None:
    """Write ``data`` to ``path`` so that a reader, or a crash, sees the old file or the new one.

    The bytes go to a temporary file in the same folder, are synced, renamed over ``path``, and
    the folder is synced. ``mode`` is who may read it, None for whom the umask allows.

    Raises:
        RiposteError: there is no space, or the folder cannot be written; the old file is intact.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb", buffering=0) as file:
            if mode is not None:
                os.fchmod(file.fileno(), mode)
            _write_all(file.fileno(), memoryview(data))
            os.fsync(file.fileno())
        os.replace(temporary, target)
    except OSError as error:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise explain(error, target, len(data)) from error
    sync_folder(target.parent)


def sync_folder(folder: Path) -> None:
    """Make the names in ``folder`` durable."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def require_free_space(folder: str | os.PathLike[str], needed_bytes: int) -> None:
    """Check that the disk of ``folder`` has room.

    Raises:
        RiposteError: there is less than ``needed_bytes`` free.
    """
    free = shutil.disk_usage(_existing(Path(folder))).free
    if free < needed_bytes:
        raise RiposteError(
            f"no space left: {os.fspath(folder)} has {free / MIB:.0f} MiB free, "
            f"{needed_bytes / MIB:.0f} MiB are needed; free some or choose another folder"
        )


class RunLock:
    """The right of one process to write into a folder; released by ``close`` or by any death."""

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        """Take the lock.

        Raises:
            RiposteError: another process has it (its id is named), or the folder is not writable.
        """
        self.path = Path(folder) / "lock"
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            descriptor = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise explain(error, self.path, 0) from error
        self._descriptor: int | None = descriptor
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            holder = os.pread(descriptor, 64, 0).decode("ascii", "replace").strip() or "unknown"
            self.close()
            raise RiposteError(
                f"{self.path.parent} is in use by process {holder}: "
                "wait for it, stop it, or choose another folder"
            ) from error
        with contextlib.suppress(OSError):  # a full disk: the lock holds without our id in it
            os.ftruncate(descriptor, 0)
            os.pwrite(descriptor, f"{os.getpid()}\n".encode("ascii"), 0)

    def close(self) -> None:
        """Release it; a second call does nothing. The file stays, it is only a place to lock."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def __enter__(self) -> "RunLock":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def append_at(descriptor: int, end: int, data: bytes, path: Path, *, is_synced: bool) -> int:
    """Add to an open file that ends at ``end``, or leave it as it was; return where it ends now.

    Args:
        descriptor: of the file.
        end: its size (bytes).
        data: what is added.
        path: of the file, for messages.
        is_synced: return when it is on the disk.

    Raises:
        RiposteError: there is no space, or the file cannot be written.
    """
    view, at = memoryview(data), end
    try:
        while view:
            written = os.pwrite(descriptor, view, at)
            view, at = view[written:], at + written
        if is_synced:
            os.fsync(descriptor)
    except OSError as error:
        os.ftruncate(descriptor, end)
        raise explain(error, path, len(data)) from error
    return at


def _write_all(descriptor: int, data: memoryview) -> None:
    view = data.cast("B")
    while view.nbytes:
        view = view[os.write(descriptor, view) :]


def _existing(path: Path) -> Path:
    while not path.exists():
        path = path.parent
    return path


def explain(error: OSError, target: Path, size: int) -> RiposteError:
    """Return what a user is told after a write that failed.

    Args:
        error: what the system said.
        target: the file that was to be written.
        size: of what was to be written (bytes).
    """
    if error.errno in OUT_OF_SPACE:
        before = (
            f"the {target.name} from before is intact" if target.exists() else "nothing is lost"
        )
        return RiposteError(
            f"no space left to write {target} ({size / MIB:.1f} MiB): {before}; "
            "free some space and start again"
        )
    return RiposteError(f"cannot write {target}: {error.strerror or error}")
