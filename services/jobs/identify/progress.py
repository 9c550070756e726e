"""Shows how far `riposte identify` is: bars on a terminal, a line now and then elsewhere."""

from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

from shared.clock import Clock
from shared.identification.progress import STEPS, Step

LINE_SECONDS = 5.0
"""Between two lines on one step where there is no terminal."""


class StepDisplay:
    """One bar a step, one more when it is done again for another cause."""

    def __init__(self, clock: Clock, console: Console | None = None) -> None:
        self._clock = clock
        self._console = console if console is not None else Console(stderr=True)
        self._bars = Progress(
            TextColumn("{task.description:<12}"),
            BarColumn(bar_width=24),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("{task.fields[note]}", style="dim", markup=False),
            console=self._console,
            disable=not self._console.is_terminal,
        )
        self._visits: dict[Step, int] = {}
        self._now: Step | None = None
        self._bar: TaskID | None = None
        self._begin = clock.now()
        self._line_at = self._begin

    def __enter__(self) -> "StepDisplay":
        self._bars.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self._end_bar()
        self._bars.stop()

    def __call__(self, step: Step, share: float, note: str = "") -> None:
        """Show how far a step is; see ``shared.identification.progress``."""
        is_new = step != self._now
        if is_new:
            self._end_bar()
            self._now = step
            self._visits[step] = self._visits.get(step, 0) + 1
            again = f" {self._visits[step]}" if self._visits[step] > 1 else ""
            self._bar = self._bars.add_task(f"{step}{again}", total=1.0, note="")
        assert self._bar is not None  # the first step is new
        done = min(max(share, 0.0), 1.0)
        self._bars.update(self._bar, completed=done, note=note)
        now = self._clock.now()
        if not self._console.is_terminal and (is_new or now >= self._line_at):
            self._line_at = now + LINE_SECONDS
            self.say(self.line(step, done, note, now))

    def line(self, step: Step, share: float, note: str, now: float) -> str:
        """Return where it stands in a line."""
        number = f"[{STEPS.index(step) + 1}/{len(STEPS)}]"
        text = f"{number} {step:<12} {share:>4.0%}  {now - self._begin:5.0f} s"
        return f"{text}  {note}" if note else text

    def say(self, text: str) -> None:
        """Show an event."""
        self._console.print(text, soft_wrap=True, markup=False, highlight=False)

    def _end_bar(self) -> None:
        if self._bar is not None:
            self._bars.update(self._bar, completed=1.0, note="")
