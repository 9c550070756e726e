"""What an input may not do: take much memory, run code, write files, call out."""

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

FORBIDDEN = frozenset({
    "pickle.find_class", "os.system", "os.exec", "os.posix_spawn", "os.fork", "os.forkpty",
    "subprocess.Popen", "socket.connect", "socket.bind", "socket.sendto", "ctypes.dlopen",
    "sqlite3.enable_load_extension", "sqlite3.load_extension", "shutil.unpack_archive",
    "os.remove", "os.rename", "os.rmdir", "os.symlink", "os.link", "os.chmod", "os.chown",
    "os.putenv", "urllib.Request", "webbrowser.open",
})  # fmt: skip
"""Audit events that no reader of foreign bytes has a reason to raise."""
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND

_STATUS = Path("/proc/self/status")
_PEAK = Path("/proc/self/clear_refs")
_PAGE = os.sysconf("SC_PAGE_SIZE")


class Guard:
    """Listens to the interpreter's audit events while an input is read.

    Made once in a process, for a hook cannot be taken off again.
    """

    def __init__(self, folder: Path) -> None:
        """Begin to listen.

        Args:
            folder: the only place where files may be written.
        """
        self._folder = str(folder.resolve()) + os.sep
        self._is_on = False
        self.events: list[str] = []
        """What was done that must not be."""
        sys.addaudithook(self._hear)

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Listen within the block."""
        self._is_on = True
        try:
            yield
        finally:
            self._is_on = False

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if not self._is_on:
            return
        if event in FORBIDDEN:
            if event in ("os.remove", "os.rename", "os.rmdir") and self._is_inside(arguments[0]):
                return
            self._note(event, arguments)
        elif event == "open":
            path, _, flags = arguments
            if flags & _WRITES and not isinstance(path, int) and not self._is_inside(path):
                self._note("open for writing", arguments)
        elif event == "exec" and _is_foreign(arguments[0]):
            self._note("exec", (arguments[0].co_filename,))

    def _is_inside(self, path: object) -> bool:
        text = os.fsdecode(path) if isinstance(path, str | bytes | os.PathLike) else ""
        return text.startswith((self._folder, "/dev/null", "/proc/self/"))

    def _note(self, event: str, arguments: tuple[Any, ...]) -> None:
        if len(self.events) < 100:
            self.events.append(f"{event} {arguments!r}"[:300])


def _is_foreign(code: Any) -> bool:
    """Return whether code comes from no file, and from nobody who is known to make code."""
    if not code.co_filename.startswith("<") or code.co_filename.startswith("<frozen "):
        return False
    frame = sys._getframe(2)
    makers = ("dataclasses", "collections", "rosbags.", "importlib", "msgspec", "attr", "enum",
              "typing", "numpy", "hypothesis")  # fmt: skip
    return not str(frame.f_globals.get("__name__", "")).startswith(makers)


def resident() -> int:
    """Return the memory of this process (bytes)."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * _PAGE


def forget_peak() -> int:
    """Begin to measure the peak of memory anew; returns the memory now (bytes)."""
    _PEAK.write_text("5", encoding="ascii")
    return resident()


def peak() -> int:
    """Return the most memory since ``forget_peak`` (bytes)."""
    for line in _STATUS.read_text(encoding="ascii").splitlines():
        if line.startswith("VmHWM:"):
            return int(line.split()[1]) << 10
    raise RuntimeError("no VmHWM in /proc/self/status")


def size() -> int:
    """Return the address space of this process (bytes)."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0]) * _PAGE


def collected() -> None:
    """Give back what nobody needs, so that the next measurement is of the next input."""
    gc.collect()
