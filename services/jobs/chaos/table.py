"""The recovery table: on a terminal, and between two marks in docs/reliability.md."""

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

from services.jobs.chaos.records import Injection, JobEnd
from services.jobs.chaos.timeline import FULL, WINDOW
from shared.errors import ConfigError
from shared.runtime.files import atomic_write

BEGIN, END = "<!-- chaos:begin -->", "<!-- chaos:end -->"
HEAD = (
    "Fault", "What is done", "To whom", "n", "Lost", "Twice", "Bad snapshots", "Lies believed",
    "Outside the rules", "Not back", "Not timed", "Full rate after, median", "worst",
)  # fmt: skip


@dataclass(frozen=True)
class Kind:
    """A fault as the table names it."""

    name: str
    what: str
    strikes: str


@dataclass(frozen=True)
class Row:
    """What all injections of one fault came to."""

    kind: Kind
    count: int
    lost: int
    twice: int
    bad_snapshots: int
    lies: int
    unsafe: int | None
    """None where no robot is there."""
    never: int
    """Injections after which the rate was not full again in time."""
    untimed: int
    """Injections in which the whole machine stood still, whose times say nothing."""
    median: float | None
    worst: float | None

    @property
    def cells(self) -> tuple[str, ...]:
        """Return it as words."""
        numbers = (self.count, self.lost, self.twice, self.bad_snapshots, self.lies)
        unsafe = "" if self.unsafe is None else str(self.unsafe)
        return (
            self.kind.name, self.kind.what, self.kind.strikes, *map(str, numbers), unsafe,
            str(self.never), str(self.untimed), _seconds(self.median), _seconds(self.worst),
        )  # fmt: skip

    @property
    def is_harmless(self) -> bool:
        """Return whether nothing was lost and everything came back."""
        harm = (self.lost, self.twice, self.bad_snapshots, self.lies, self.unsafe or 0, self.never)
        return not any(harm)


def rows_of(
    kinds: Iterable[Kind], injections: Sequence[Injection], robot: frozenset[str]
) -> list[Row]:
    """Return a row for each fault that was injected.

    Args:
        kinds: in the order of the table.
        injections: all that are kept.
        robot: names of the faults that strike a robot's site.
    """
    rows: list[Row] = []
    for kind in kinds:
        mine = [injection for injection in injections if injection.fault == kind.name]
        if not mine:
            continue
        timed = [injection for injection in mine if not injection.stalled]
        full = [injection.full for injection in timed if injection.full is not None]
        rows.append(
            Row(
                kind=kind,
                count=len(mine),
                lost=sum(one.toll.lost for one in mine),
                twice=sum(one.toll.twice for one in mine),
                bad_snapshots=sum(one.toll.bad_snapshots for one in mine),
                lies=sum(one.toll.lies for one in mine),
                unsafe=sum(one.unsafe for one in mine) if kind.name in robot else None,
                never=len(timed) - len(full),
                untimed=len(mine) - len(timed),
                median=statistics.median(full) if full else None,
                worst=max(full, default=None),
            )
        )
    return rows


def rich_table(rows: Sequence[Row]) -> Table:
    """Return the table for a terminal."""
    table = Table(box=None, padding=(0, 1))
    for name in (HEAD[0], *HEAD[3:]):
        is_name = name == HEAD[0]
        table.add_column(name, justify="left" if is_name else "right", no_wrap=is_name)
    for row in rows:
        cells = row.cells
        table.add_row(cells[0], *cells[3:], style="" if row.is_harmless else "bold red")
    return table


def summary(injections: Sequence[Injection], jobs: Sequence[JobEnd]) -> str:
    """Return what all of it came to, in a sentence."""
    finished = sum(job.finished for job in jobs)
    last = {injection.job: injection for injection in injections}.values()
    names, commands = sum(one.names for one in last), sum(one.commands for one in last)
    text = (
        f"{len(injections)} faults in {len(last)} runs; {finished} of the {len(jobs)} runs that "
        f"were watched to their end finished; {names} acknowledged "
        "rollouts and results were compared with the ledgers, name by name"
    )
    told, refused = (
        sum(sum(getattr(one, name).values()) for one in injections) for name in ("told", "refused")
    )
    if told:
        text += f"; {told} lies and damaged files were offered, {refused} of them refused"
    robot = f"; {commands} states of the gate were checked against its rules" if commands else ""
    return f"{text}{robot}."


def markdown(rows: Sequence[Row], said: str, machine: str) -> str:
    """Return the generated block, without its marks."""
    lines = [f"{said}", "", "| " + " | ".join(HEAD) + " |", "|---" * 3 + "|--:" * 10 + "|"]
    lines += ["| " + " | ".join((f"`{row.cells[0]}`", *row.cells[1:])) + " |" for row in rows]
    note = (
        f"Full rate: a window of {WINDOW:g} s with at least {100 * FULL:.0f} % of the median of "
        f"the undisturbed windows before. Not timed: the whole machine stood still for more than "
        f"2 s, so that the watcher itself was not served. {machine}"
    )
    return "\n".join([*lines, "", note])


def write_block(page: Path, text: str) -> None:
    """Put the block into a page, between its marks.

    Raises:
        ConfigError: there is no such page, or it has no marks.
        RiposteError: it cannot be written.
    """
    try:
        before = page.read_text(encoding="utf-8")
    except OSError as error:
        raise ConfigError(
            f"cannot read {page} ({error.strerror}): --write is for a checkout"
        ) from error
    head, begin, rest = before.partition(BEGIN)
    _, end, tail = rest.partition(END)
    if not (begin and end):
        raise ConfigError(f"{page} lacks the marks {BEGIN} and {END}, between which to write")
    atomic_write(page, f"{head}{BEGIN}\n{text}\n{END}{tail}".encode())


def _seconds(value: float | None) -> str:
    return "" if value is None else f"{value:.1f} s"
