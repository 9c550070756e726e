"""What a soak keeps, a line of JSON every few seconds: readable whenever it was killed."""

import dataclasses
from pathlib import Path

import msgspec
import psutil

from shared.errors import ConfigError


@dataclasses.dataclass(frozen=True)
class Kept:
    """A soak, as far as it went."""

    started: "Started"
    samples: list["Sample"]
    ended: str
    """Why it ended early; empty when it did not, or was killed."""


class ProcessUse(msgspec.Struct, frozen=True, kw_only=True):
    """One process, as the kernel sees it."""

    pid: int
    rss_bytes: int
    files: int
    """Open file descriptors."""
    threads: int
    cpu_seconds: float


class Started(msgspec.Struct, frozen=True, kw_only=True):
    """The first line of a soak: where it runs."""

    minutes: float
    """That it is to last."""
    cores: int
    processor: str
    commit: str


class Sample(msgspec.Struct, frozen=True, kw_only=True):
    """How everything stood at one instant."""

    at: float
    """Seconds since the soak began, by the monotonic clock."""
    processes: dict[str, ProcessUse]
    """By job and name: ``train/actor-0``."""
    version: int
    """Of the learning agent: updates made."""
    batch_samples: int
    lateness_ms: tuple[float, float, float] | None
    """Median, 99th percentile and largest of the control ticks since the sample before; None when
    none was heard."""
    ticks: int
    """Control ticks due since robot_io started; the next two are counted likewise."""
    ticks_late: int
    """More than 10 ms late."""
    ticks_lost: int
    bouts: int
    """Finished since the soak began."""
    disk_bytes: dict[str, int]
    """Of each job's folder."""
    load: float
    """Load average of the last minute."""


class Ended(msgspec.Struct, frozen=True, kw_only=True):
    """The last line of a soak that did not go on to its end."""

    ended: str
    """Why."""


def use_of(pid: int) -> ProcessUse:
    """Return what a process uses.

    Raises:
        psutil.Error: it is gone.
    """
    process = psutil.Process(pid)
    with process.oneshot():
        return ProcessUse(
            pid=pid,
            rss_bytes=process.memory_info().rss,
            files=process.num_fds(),
            threads=process.num_threads(),
            cpu_seconds=sum(process.cpu_times()[:2]),
        )


def disk_use(folder: Path) -> int:
    """Return the bytes of all files in a folder; those that vanish meanwhile do not count."""
    total = 0
    for path in folder.rglob("*"):
        try:
            total += path.stat().st_size if path.is_file() else 0
        except OSError:
            continue
    return total


def read(path: Path) -> Kept:
    """Return what a file holds; a last line cut short is left out.

    Raises:
        ConfigError: the file cannot be read, or a whole line in it is not of a soak.
    """
    try:
        lines = path.read_bytes().splitlines(keepends=True)
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error.strerror}") from error
    started: Started | None = None
    samples: list[Sample] = []
    ended = ""
    for number, line in enumerate(lines, 1):
        if not line.endswith(b"\n"):
            continue
        try:
            if number == 1:
                started = msgspec.json.decode(line, type=Started)
            elif line.startswith(b'{"ended"'):
                ended = msgspec.json.decode(line, type=Ended).ended
            else:
                samples.append(msgspec.json.decode(line, type=Sample))
        except msgspec.MsgspecError as error:
            raise ConfigError(f"{path}, line {number} is not of a soak: {error}") from error
    if started is None:
        raise ConfigError(f"{path} is empty: the soak was killed before it began")
    return Kept(started, samples, ended)
