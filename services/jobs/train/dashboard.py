"""The terminal dashboard of a training run: what is learned, how fast, and how everybody is.

On a terminal it is redrawn twice a second; elsewhere, in the log of a CI job say, it is one plain
line every few seconds.
"""

from collections.abc import Mapping
from pathlib import Path
from types import TracebackType

from rich.console import Console
from rich.live import Live

from services.jobs.plain import printable
from services.jobs.report.words import clock_text
from services.jobs.train.dashboard_view import State, line, render
from shared.bus.base import Bus
from shared.clock import Clock
from shared.messages.topics import PROGRESS, STATUS
from shared.telemetry.door import read_live_view

DRAW_PERIOD = 0.5
LINE_PERIOD = 5.0
"""Seconds between two plain lines."""


class Dashboard:
    """Listens to a run and shows it; use it as a context."""

    def __init__(
        self, bus: Bus, clock: Clock, folder: Path, console: Console | None = None
    ) -> None:
        self._clock = clock
        self._folder = folder
        self._console = console if console is not None else Console()
        self._progress = bus.subscribe(PROGRESS)
        self._status = bus.subscribe(STATUS)
        self._due_at = 0.0
        self._said = 0
        self._live: Live | None = None
        now = clock.now()
        self.state = State(run=folder.resolve().name, started_at=now, now=now)

    def __enter__(self) -> "Dashboard":
        if self._console.is_terminal:
            self._live = Live(
                render(self.state), console=self._console, auto_refresh=False, transient=True
            )
            self._live.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._listen()
        if self._live is not None:
            self._live.stop()
            self._live = None
        self._progress.close()
        self._status.close()

    def tick(self, restarts: Mapping[str, int]) -> None:
        """Take what was said and draw it when it is time.

        Args:
            restarts: how often each process was started again.
        """
        self.state.now = self._clock.now()
        self.state.restarts = restarts
        self._listen()
        if self.state.now < self._due_at:
            return
        self._due_at = self.state.now + (DRAW_PERIOD if self._live is not None else LINE_PERIOD)
        if not self.state.url:
            view = read_live_view(self._folder)
            self.state.url = view.url if view is not None else ""
            if self.state.url and self._live is None:
                self._print(f"live view: {self.state.url}")
        if self._live is not None:
            self._live.update(render(self.state), refresh=True)
        elif self.state.progress is not None:
            self._print(line(self.state))

    def say(self, text: str) -> None:
        """Show an event."""
        self.state.now = self._clock.now()
        self.state.say(text)
        if self._live is None:
            self._print(printable(text))

    def _listen(self) -> None:
        while (status := self._status.take()) is not None:
            self.state.on_status(status)
        while (progress := self._progress.take()) is not None:
            self.state.on_progress(progress)

    def _print(self, text: str) -> None:
        elapsed = clock_text(self.state.now - self.state.started_at)
        self._console.print(f"{elapsed} {text}", soft_wrap=True, markup=False, highlight=False)
