"""Recording files on disk: which belong to a run, and mending one that a crash cut short."""

import struct
from pathlib import Path

from shared.errors import RiposteError

_HEADER = 12
_FRAME = struct.Struct("<QQ")
_MAGIC = b"RRF2"


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
