"""Recording files on disk: written whole, mended after a crash, compacted at the end.

A recording is a header and messages, each behind its kind and length; a zero kind ends it and an
index may follow. Rerun's own file sink can neither say that a write failed nor be closed after
one, so the bytes are taken from it and written here.
"""

import contextlib
import os
import struct
import subprocess
from pathlib import Path

from shared.errors import RiposteError
from shared.telemetry.viewer import viewer_program

_HEADER = 12
_FRAME = struct.Struct("<QQ")
_MAGIC = b"RRF2"
COMPACT_SECONDS = 8.0
"""A recording that takes longer than this to compact stays as it is."""


class RecordingFile:
    """Whole messages, one after the other; after a failed write the file ends where it did."""

    def __init__(self, path: Path) -> None:
        """Make the file.

        Raises:
            OSError: it is there already, or the folder cannot be written.
        """
        self.path = path
        self.size = 0
        """Bytes of whole messages."""
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)

    def write(self, stream: bytes) -> None:
        """Append the messages of a piece of a stream.

        Args:
            stream: begins with a header; every piece of Rerun's is a little recording.

        Raises:
            OSError: no space left; what was written before is whole.
        """
        messages = memoryview(stream)[: end_of_messages(stream)]
        if self.size:
            messages = messages[_HEADER:]
        try:
            while messages:
                messages = messages[os.write(self._descriptor, messages) :]
        except OSError:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, self.size)
            raise
        self.size = os.lseek(self._descriptor, 0, os.SEEK_CUR)

    def close(self) -> None:
        """Close the file; one that got nothing is taken away."""
        os.close(self._descriptor)
        if not self.size:
            with contextlib.suppress(OSError):
                self.path.unlink()


def end_of_messages(stream: bytes) -> int:
    """Return where the whole messages of a stream end."""
    end = min(_HEADER, len(stream))
    while end + _FRAME.size <= len(stream):
        kind, length = _FRAME.unpack_from(stream, end)
        if kind == 0 or end + _FRAME.size + length > len(stream):
            break
        end += _FRAME.size + length
    return end


def compact(path: Path) -> bool:
    """Rewrite a closed recording in fewer, larger chunks and with an index; loads much faster.

    Returns whether that worked; when it did not, the recording is as it was.
    """
    compacted = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    command = [str(viewer_program()), "rrd", "optimize", str(path), "-o", str(compacted)]
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=COMPACT_SECONDS,
            check=False,
        )
        if done.returncode == 0 and compacted.stat().st_size > _HEADER:
            compacted.replace(path)
            return True
    except (OSError, subprocess.TimeoutExpired):
        pass
    with contextlib.suppress(OSError):
        compacted.unlink()
    return False


def recordings(folder: Path) -> list[Path]:
    """Return the recordings of a run, oldest first."""
    found = [(0, folder / "recording.rrd")] if (folder / "recording.rrd").exists() else []
    for path in folder.glob("recording-*.rrd"):
        number = path.stem.removeprefix("recording-")
        if number.isdecimal():
            found.append((int(number), path))
    return [path for _, path in sorted(found)]


def next_recording(folder: Path) -> Path:
    """Return the name for a new recording: a restarted recorder never writes over an old one."""
    found = recordings(folder)
    if not found:
        return folder / "recording.rrd"
    last = found[-1].stem.removeprefix("recording").removeprefix("-")
    return folder / f"recording-{int(last or 0) + 1}.rrd"


def trim(path: Path) -> int:
    """Cut off a half-written message at the end; return how many bytes that was.

    A process that is killed, or a full disk, can leave half a message behind, and Rerun's
    reader then refuses the whole file. Everything before it stays.

    Raises:
        RiposteError: the file is not a Rerun recording.
    """
    size = path.stat().st_size
    with path.open("rb+") as file:
        if file.read(len(_MAGIC)) != _MAGIC:
            raise RiposteError(f"{path} is not a Rerun recording (it does not begin with RRF2)")
        end = min(_HEADER, size)
        while end + _FRAME.size <= size:
            file.seek(end)
            kind, length = _FRAME.unpack(file.read(_FRAME.size))
            if kind == 0:  # the end of the stream; a footer may follow
                return 0
            if end + _FRAME.size + length > size:
                break
            end += _FRAME.size + length
        if end < size:
            file.truncate(end)
    return size - end
