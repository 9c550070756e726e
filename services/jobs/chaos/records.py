"""What is kept of every injection: a line of JSON each, so that nothing is done twice."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import msgspec

from services.jobs.chaos.books import Toll
from shared.errors import ConfigError
from shared.runtime.files import atomic_write

S = TypeVar("S", bound=msgspec.Struct)

INJECTIONS = "injections.jsonl"
JOBS = "jobs.jsonl"


class Injection(msgspec.Struct, frozen=True, kw_only=True):
    """One fault, once."""

    fault: str
    job: str
    """Of which run of the job it was a part."""
    victim: str
    at: float
    """Since the job began (s)."""
    lasted: float
    """How long the fault itself went on (s); 0 for what happens in an instant."""
    back: float | None
    """From the end of the fault until what was struck was up again (s); None: it was not."""
    full: float | None
    """From the end of the fault until the rate was full again (s); None: it was not."""
    base: float
    """Median rate before it (samples/s, or states/s of a robot)."""
    during: float | None = None
    """Rate while it went on, where it lasts long enough to say."""
    toll: Toll = Toll()
    names: int = 0
    """Acknowledged names of the run that have been compared with its ledger by then."""
    commands: int = 0
    """Commands to the robot that have been checked by then."""
    unsafe: int = 0
    """Commands to the robot outside the gate's rules."""
    told: dict[str, int] = {}
    """Lies by kind."""
    refused: dict[str, int] = {}
    """Those that were refused."""
    stalled: float = 0.0
    """How long the whole machine stood still meanwhile (s): then its times say nothing."""
    load: float = 0.0
    """Load average of the machine, per core."""
    note: str = ""


class JobEnd(msgspec.Struct, frozen=True, kw_only=True):
    """How a run of the job ended."""

    job: str
    seconds: float
    exit_code: int
    finished: bool
    """Exit code 0 and a ledger that says that everything was done."""
    toll: Toll = Toll()
    """Over the whole run."""
    unsafe: int = 0
    commit: str = ""


class Records:
    """The injections and jobs kept in a folder."""

    def __init__(self, folder: Path) -> None:
        """Read what is there.

        Raises:
            ConfigError: a line is damaged; names it.
        """
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.injections: list[Injection] = _read(folder / INJECTIONS, Injection)
        self.jobs: list[JobEnd] = _read(folder / JOBS, JobEnd)

    def add(self, injection: Injection) -> None:
        """Keep an injection."""
        self.injections.append(injection)
        _write(self._folder / INJECTIONS, self.injections)

    def end(self, job: JobEnd) -> None:
        """Keep the end of a job."""
        self.jobs.append(job)
        _write(self._folder / JOBS, self.jobs)

    @property
    def counts(self) -> Counter[str]:
        """Return how often each fault was injected."""
        return Counter(injection.fault for injection in self.injections)

    def unfinished(self, site: str) -> str:
        """Return the site's job that has injections and no end, empty where none is."""
        ended = {job.job for job in self.jobs}
        names = [i.job for i in self.injections if i.job.startswith(f"{site}-")]
        return next((name for name in reversed(names) if name not in ended), "")


def _read(path: Path, kind: type[S]) -> list[S]:
    if not path.exists():
        return []
    found: list[S] = []
    for number, line in enumerate(path.read_bytes().splitlines(), 1):
        try:
            found.append(msgspec.json.decode(line, type=kind))
        except msgspec.MsgspecError as error:
            raise ConfigError(
                f"{path} line {number} is damaged ({error}); remove the line, or choose "
                "another --out"
            ) from error
    return found


def _write(path: Path, lines: Sequence[msgspec.Struct]) -> None:
    atomic_write(path, b"".join(msgspec.json.encode(line) + b"\n" for line in lines))
