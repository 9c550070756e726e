"""What a match looks like in the terminal: a small panel, or plain lines where there is none."""

from collections import deque
from types import TracebackType

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from services.jobs.plain import plain, printable
from services.jobs.play.match import Match
from services.jobs.play.plan import Plan
from services.jobs.play.summary import loop_of, loop_text
from services.jobs.report.words import clock_text
from shared.bus.base import Bus
from shared.clock import Clock
from shared.messages.live import ServiceStatus
from shared.messages.topics import STATUS

DRAW_PERIOD = 0.2
LINE_PERIOD = 5.0
"""Seconds between two plain lines."""
EVENTS = 6
COLOURS = {
    "armed": "green", "ramping": "green", "holding": "yellow", "tripped": "bold red",
    "disarmed": "grey62",
}  # fmt: skip


class Screen:
    """Shows a match; use it as a context."""

    def __init__(
        self, plan: Plan, match: Match, bus: Bus, clock: Clock, console: Console, title: str = ""
    ) -> None:
        """Listen to robot_io's status; draw on ``console``."""
        self.status: ServiceStatus | None = None
        """What robot_io said last."""
        self.places: dict[str, str] = {}
        """Addresses that can be opened, by what is there."""
        self.notes: tuple[str, ...] = ()
        """Lines about what else goes on."""
        self._title = title or f"{plan.antagonist.label} v {plan.protagonist.label}"
        self._match = match
        self._clock = clock
        self._console = console
        self._statuses = bus.subscribe(STATUS, role="robot-io")
        self._began_at = clock.now()
        self._due_at = 0.0
        self._events: deque[tuple[float, str]] = deque(maxlen=EVENTS)
        self._live: Live | None = None
        self._shown = ""
        """The last plain line about how it stands."""

    def __enter__(self) -> "Screen":
        if self._console.is_terminal:
            self._live = Live(console=self._console, auto_refresh=False, transient=True)
            self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None
        self._statuses.close()

    def tick(self) -> None:
        """Take what was said and draw it when it is time."""
        while (status := self._statuses.take()) is not None:
            self.status = status
        for text in self._match.take_events():
            self.say(text)
        now = self._clock.now()
        if now < self._due_at:
            return
        if self._live is not None:
            self._due_at = now + DRAW_PERIOD
            self._live.update(self._panel(), refresh=True)
        else:
            self._due_at = now + LINE_PERIOD
            text = printable(", ".join((*self.notes, line(self._match))))
            if text != self._shown:
                self._print(text)
            self._shown = text

    def say(self, text: str) -> None:
        """Show an event."""
        text = printable(text)
        self._events.append((self._clock.now(), text))
        if self._live is None:
            self._print(text)

    def _print(self, text: str) -> None:
        elapsed = clock_text(self._clock.now() - self._began_at)
        self._console.print(f"{elapsed} {text}", soft_wrap=True, markup=False, highlight=False)

    def _panel(self) -> RenderableType:
        match = self._match
        parts: list[RenderableType] = [bout_row(match)]
        parts += [plain(note) for note in self.notes]
        if match.gate is not None:
            mode = match.gate.mode
            reason = printable(f"  {match.gate.reason}".rstrip())
            parts.append(Text.assemble("robot ", (mode, COLOURS[mode]), reason))
        if match.waits_for:
            parts.append(plain(f"waits for {match.waits_for}", "yellow"))
        if self.status is not None:
            parts.append(Text(loop_text(loop_of(self.status)), "dim"))
        for at, text in self._events:
            elapsed = clock_text(at - self._began_at)
            parts.append(Text.assemble((f"{elapsed:>6}  ", "dim"), text))
        for name, url in self.places.items():
            parts.append(Text.assemble((f"{name}  ", "bold"), (url, "underline cyan")))
        return Panel(
            Group(*parts),
            title=Text.assemble(("riposte ", "bold"), self._title),
            title_align="left",
            subtitle="Ctrl-C ends",
            subtitle_align="right",
            border_style="grey50",
            padding=(0, 1),
        )


def bout_row(match: Match) -> Table:
    """Return bout, phase, time and score in a row."""
    words = bout_words(match)
    grid = Table.grid(*("" for _ in words), padding=(0, 3, 0, 0))
    grid.add_row(*map(plain, words))
    return grid


def bout_words(match: Match) -> tuple[str, ...]:
    """Return where the bout stands, in a few words each."""
    state, terms = match.referee, match.terms
    count = f"{match.finished} of {terms.bouts}" if terms.bouts else f"{match.finished}"
    done = f"bouts {count}"
    if state is None or not state.bout:
        return (done, "no bout yet")
    words = (done, state.bout, state.phase, f"{state.seconds:.1f} s", f"score {state.score:+g}")
    if not match.is_bout_on and terms.starts and not match.waits_for and not match.is_over:
        return (*words, f"next in {match.rest_seconds:.0f} s")
    return words


def line(match: Match) -> str:
    """Return where the match stands as one plain line."""
    mode = f"robot {match.gate.mode}" if match.gate is not None else "no robot yet"
    waits = (f"waits for {match.waits_for}",) if match.waits_for else ()
    return ", ".join((*bout_words(match), mode, *waits))
