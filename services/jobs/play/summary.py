"""What a match leaves: ``summary.json`` in its folder, and the lines it ends with."""

import statistics
from collections.abc import Sequence
from pathlib import Path

import msgspec

from services.jobs.plain import printable
from services.jobs.play.match import BoutResult
from services.jobs.play.plan import SUMMARY, Plan
from shared.messages.live import ServiceStatus
from shared.runtime.build import commit
from shared.runtime.files import atomic_write

SCHEMA = 1
LOOP_RATES = (
    "real_time_factor", "lateness_p50_ms", "lateness_p99_ms", "lateness_max_ms",
    "command_p50_ms", "command_p99_ms", "command_max_ms",
)  # fmt: skip
LOOP_COUNTERS = (
    "ticks", "ticks_late", "ticks_lost", "commands_sent", "commands_clipped", "commands_repeated",
    "trips",
)  # fmt: skip


class PlayedMatch(msgspec.Struct, frozen=True, kw_only=True):
    """What ``summary.json`` holds."""

    schema: int = SCHEMA
    run: str
    antagonist: str
    """As the command line named it."""
    protagonist: str
    link: str
    bouts: tuple[BoutResult, ...]
    planned: int
    """Bouts that were asked for; 0: as many as it may be."""
    ended: str
    """Why it ended before the last of them; empty where it did not."""
    loop: dict[str, float]
    """What robot_io said of its loop last: the last minute's times, counts since its start."""
    deaths: tuple[str, ...]
    """Processes that died, in order."""
    commit: str

    @property
    def scores(self) -> list[float]:
        """Return the antagonist's score of every bout that came to its end."""
        return [bout.score for bout in self.bouts if bout.outcome == "finished"]


def summary_of(
    plan: Plan,
    results: Sequence[BoutResult],
    status: ServiceStatus | None,
    deaths: Sequence[str],
    ended: str,
) -> PlayedMatch:
    """Return what came of a match.

    Args:
        plan: what was asked for.
        results: of its bouts, in order.
        status: robot_io's last; None if it never said anything.
        deaths: processes that died.
        ended: why it ended early.
    """
    return PlayedMatch(
        run=plan.run,
        antagonist=plan.antagonist.label,
        protagonist=plan.protagonist.label,
        link=plan.link,
        bouts=tuple(results),
        planned=plan.bouts,
        ended=ended,
        loop=loop_of(status) if status is not None else {},
        deaths=tuple(deaths),
        commit=commit(),
    )


def loop_of(status: ServiceStatus) -> dict[str, float]:
    """Return the figures of the 100 Hz loop in robot_io's status."""
    rates = {name: status.rates[name] for name in LOOP_RATES if name in status.rates}
    counters = {name: status.counters[name] for name in LOOP_COUNTERS if name in status.counters}
    return rates | counters


def write_summary(folder: Path, match: PlayedMatch) -> None:
    """Write ``summary.json``."""
    atomic_write(folder / SUMMARY, msgspec.json.format(msgspec.json.encode(match), indent=1))


def summary_text(folder: Path, match: PlayedMatch) -> str:
    """Return the lines that a match ends with."""
    lines = ["", f"{match.antagonist} v {match.protagonist}: {_score_line(match)}"]
    if match.bouts:
        lines.append(f"{'bout':<18}{'score':>9}{'hits':>8}{'touches':>9}{'camping':>9}{'time':>9}")
    lines += map(_bout_line, match.bouts)
    if match.ended:
        lines.append(f"ended early: {printable(match.ended)}")
    if match.loop:
        lines.append(loop_text(match.loop))
    lines += [f"died: {name}" for name in match.deaths]
    if (folder / "recording.rrd").exists():
        lines.append(f"recording  riposte watch {folder}")
    return "\n".join(lines)


def loop_text(loop: dict[str, float]) -> str:
    """Return how the 100 Hz loop did, on one line."""
    parts: list[str] = []
    if "real_time_factor" in loop:
        parts.append(f"real time {loop['real_time_factor']:.2f}x")
    if "lateness_p50_ms" in loop:
        parts.append(_times("late", loop, "lateness"))
    if "command_p50_ms" in loop:
        parts.append(_times("command after", loop, "command"))
    missed = {
        "late": loop.get("ticks_late", 0),
        "lost": loop.get("ticks_lost", 0),
        "without an answer": loop.get("commands_repeated", 0),
    }
    ticks = loop.get("ticks", 0)
    parts.append(
        f"{ticks:.0f} ticks, " + ", ".join(f"{count:.0f} {what}" for what, count in missed.items())
    )
    return " · ".join(parts)


def _bout_line(bout: BoutResult) -> str:
    why = f"  void: {printable(bout.reason)}" if bout.outcome == "void" else ""
    return (
        f"{printable(bout.bout):<18}{bout.score:>+9g}{bout.attack_steps:>8}{bout.penalty_steps:>9}"
        f"{bout.camping_steps:>9}{bout.seconds:>7.1f} s{why}"
    )


def _times(words: str, loop: dict[str, float], name: str) -> str:
    p50, p99 = loop[f"{name}_p50_ms"], loop.get(f"{name}_p99_ms", 0.0)
    most = loop.get(f"{name}_max_ms", 0.0)
    return f"{words} {p50:.2f} / {p99:.2f} / {most:.1f} ms"


def _score_line(match: PlayedMatch) -> str:
    scores = match.scores
    if not scores:
        return "no bout came to its end"
    bouts = "bout" if len(scores) == 1 else "bouts"
    mean = statistics.fmean(scores)
    return f"{len(scores)} {bouts}, {mean:+.0f} points for the antagonist on average"
