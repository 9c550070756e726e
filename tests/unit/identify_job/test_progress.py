"""Progress without a terminal: a line when a step begins, and one now and then."""

import io

from rich.console import Console

from services.jobs.identify.progress import StepDisplay


class Hands:
    """A clock that is set by hand."""

    def __init__(self) -> None:
        self.at = 100.0

    def now(self) -> float:
        return self.at

    def wall_ns(self) -> int:
        return 0


def test_steps_are_told_when_they_begin_and_every_five_seconds() -> None:
    clock, out = Hands(), io.StringIO()
    with StepDisplay(clock, Console(file=out, width=200)) as display:
        display("noise floor", 0.0)
        clock.at += 1.0
        display("base fit", 0.0)
        clock.at += 1.0
        display("base fit", 0.2, "start 1 of 3")
        clock.at += 4.0
        display("base fit", 0.6, "start 2 of 3")
    lines = [line.split() for line in out.getvalue().splitlines()]
    assert lines == [
        ["[1/7]", "noise", "floor", "0%", "0", "s"],
        ["[2/7]", "base", "fit", "0%", "1", "s"],
        ["[2/7]", "base", "fit", "60%", "6", "s", "start", "2", "of", "3"],
    ]


def test_a_step_may_come_again() -> None:
    clock, out = Hands(), io.StringIO()
    with StepDisplay(clock, Console(file=out, width=200)) as display:
        for _ in range(2):
            display("screen", 0.0)
            display("refit", 0.5, "[bold]not markup")
    told = [line.split()[1] for line in out.getvalue().splitlines()]
    assert told == ["screen", "refit", "screen", "refit"]
    assert "[bold]not markup" in out.getvalue()


def test_a_terminal_gets_a_bar_a_step() -> None:
    clock, out = Hands(), io.StringIO()
    console = Console(file=out, width=100, force_terminal=True, legacy_windows=False)
    with StepDisplay(clock, console) as display:
        display("screen", 0.5)
        display("refit", 2.0)
        display("screen", 0.1)
    shown = out.getvalue()
    assert "screen 2" in shown
    assert "refit" in shown
