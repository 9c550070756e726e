"""How the dashboard looks: pure functions of what was heard."""

import dataclasses
from collections import deque
from collections.abc import Mapping

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.progress_bar import ProgressBar
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

from services.jobs.plain import plain, printable
from services.jobs.report.words import clock_text
from shared.messages.live import Progress, ServiceStatus

GONE_SECONDS = 4.0
"""A process that has said nothing for this long is called silent."""
EVENTS = 5
HISTORY = 4096
MOST_SERVICES = 12_000
"""That are kept; the one heard longest ago goes first."""
MIB = 1 << 20
COLOURS = {"antagonist": "dark_orange3", "protagonist": "dodger_blue2"}
BLOCKS = "▁▂▃▄▅▆▇█"


@dataclasses.dataclass
class Row:
    """One process as last heard."""

    status: ServiceStatus
    heard_at: float
    cpu_percent: float = 0.0


@dataclasses.dataclass
class State:
    """What the dashboard knows; grows only up to its bounds."""

    run: str
    started_at: float
    now: float = 0.0
    progress: Progress | None = None
    services: dict[str, Row] = dataclasses.field(default_factory=dict[str, Row])
    restarts: Mapping[str, int] = dataclasses.field(default_factory=dict[str, int])
    scores: deque[tuple[str, float]] = dataclasses.field(
        default_factory=lambda: deque[tuple[str, float]](maxlen=HISTORY)
    )
    """Who learned and the mean score, one for each update."""
    pace: deque[tuple[float, int]] = dataclasses.field(
        default_factory=lambda: deque[tuple[float, int]](maxlen=32)
    )
    """When, and how many updates this stage had."""
    events: deque[tuple[float, str]] = dataclasses.field(
        default_factory=lambda: deque[tuple[float, str]](maxlen=EVENTS)
    )
    url: str = ""

    def on_progress(self, progress: Progress) -> None:
        """Take in where the run stands."""
        before, self.progress = self.progress, progress
        if before is None or before.stage != progress.stage:
            self.pace.clear()
        if not self.pace or self.pace[-1][1] != progress.update:
            self.pace.append((self.now, progress.update))
            if progress.score_bouts and progress.agent:
                self.scores.append((progress.agent, progress.score_mean))
        if progress.message and (before is None or before.message != progress.message):
            self.say(progress.message)

    def on_status(self, status: ServiceStatus) -> None:
        """Take in how a process is."""
        known = self.services.pop(status.name, None)  # the newest stands last
        row = Row(status, self.now)
        if known is not None and known.status.boot == status.boot:
            used = status.cpu_seconds - known.status.cpu_seconds
            elapsed = self.now - known.heard_at
            row.cpu_percent = 100.0 * used / elapsed if elapsed > 0 else known.cpu_percent
        elif known is not None:
            self.say(f"{status.name} came back as process {status.pid}")
        self.services[status.name] = row
        while len(self.services) > MOST_SERVICES:
            del self.services[next(iter(self.services))]

    def say(self, text: str) -> None:
        """Add an event."""
        self.events.append((self.now, printable(text)))

    def stage_eta(self) -> float | None:
        """Return the seconds that this stage's budget takes at its present pace."""
        progress = self.progress
        if progress is None or len(self.pace) < 2:
            return None
        (begin, first), (end, last) = self.pace[0], self.pace[-1]
        if last <= first or end <= begin:
            return None
        return (progress.max_updates - last) * (end - begin) / (last - first)


def line(state: State) -> str:
    """Return where the run stands as one plain line."""
    progress = state.progress
    if progress is None:
        return "starting"
    if not progress.agent:
        if progress.evaluations_total:
            return f"evaluation: {progress.evaluations_done} of {progress.evaluations_total} bouts"
        return "waiting for the learners' first versions"
    parts = [
        f"stage {progress.stage + 1}/{progress.stages}",
        f"{progress.agent} learns",
        *_round_parts(progress),
        f"update {progress.update}/{progress.max_updates}",
        f"score {_score_text(progress)}" if progress.score_bouts else "no complete bout yet",
        f"{_short(progress.total_samples)} samples, {_short(progress.samples_per_s)}/s",
        f"lag {progress.policy_lag_mean:.2f}",
        f"KL {progress.approx_kl:.4f}",
        f"EV {progress.explained_variance:.2f}",
        f"dropped {progress.dropped_rollouts}",
    ]
    if progress.eta_seconds >= 0:
        parts.append(f"ETA {clock_text(progress.eta_seconds)}")
    return printable(", ".join(parts))


def _round_parts(progress: Progress) -> list[str]:
    """Return where a round of phase two stands, and who was drawn; nothing in phase one."""
    if not progress.round:
        return []
    return [
        f"against {progress.opponent}",
        f"round {progress.round}/{progress.rounds}",
        f"iteration {progress.iteration}/{progress.iterations}",
    ]


def render(state: State) -> RenderableType:
    """Return the whole dashboard."""
    parts: list[RenderableType] = [_progress(state)]
    if state.progress is not None and state.progress.agent:
        parts += [Text(), _learning(state, state.progress)]
    if state.services:
        parts += [Rule(style="grey37"), _services(state)]
    if state.events or state.url:
        parts.append(Rule(style="grey37"))
    parts += [_event(state, at, text) for at, text in state.events]
    if state.url:
        shown = Text.assemble(("live view  ", "bold"), (state.url, "underline cyan"))
        parts.append(shown)
    elapsed = clock_text(state.now - state.started_at)
    return Panel(
        Group(*parts),
        title=Text.assemble(("riposte ", "bold"), state.run),
        title_align="left",
        subtitle=f"{elapsed} · Ctrl-C stops in order, --resume continues",
        subtitle_align="right",
        border_style="grey50",
        padding=(0, 1),
    )


def sparkline(values: list[tuple[str, float]], width: int) -> Text:
    """Return the history of the score as blocks, coloured by who learned."""
    if not values:
        return Text()
    step = max(1.0, len(values) / width)
    picked: list[tuple[str, float]] = []
    for k in range(min(width, len(values))):
        part = values[int(k * step) : max(int(k * step) + 1, int((k + 1) * step))]
        picked.append((part[-1][0], sum(value for _, value in part) / len(part)))
    low = min(value for _, value in picked)
    span = max(value for _, value in picked) - low or 1.0
    text = Text()
    for agent, value in picked:
        block = BLOCKS[min(len(BLOCKS) - 1, int((value - low) / span * len(BLOCKS)))]
        text.append(block, style=COLOURS.get(agent, ""))
    return text


def _progress(state: State) -> RenderableType:
    progress = state.progress
    if progress is None:
        heard = ", ".join(sorted(state.services)) or "nobody yet"
        return plain(f"starting; heard from {heard}", "dim")
    done = _done_share(progress)
    grid = Table.grid(padding=(0, 2, 0, 0), expand=True)
    grid.add_column(no_wrap=True)
    grid.add_column(ratio=1)
    grid.add_column(justify="right", no_wrap=True)
    if progress.agent:
        style = COLOURS.get(progress.agent, "")
        who = Text.assemble((printable(progress.agent), f"bold {style}"), " learns")
        if progress.round:
            who.append_text(plain(f" v {progress.opponent}", "dim"))
        share = progress.update / max(1, progress.max_updates)
        count = f"update {progress.update} of {progress.max_updates}"
        grid.add_row(who, _bar(share, style), _with_eta(count, state.stage_eta()))
    elif progress.evaluations_total:
        share = progress.evaluations_done / progress.evaluations_total
        count = f"bout {progress.evaluations_done:,} of {progress.evaluations_total:,}"
        grid.add_row(Text("evaluation", "bold"), _bar(share, "green"), count)
    else:
        grid.add_row(plain(progress.message or "waiting for the learners", "dim"), "", "")
    where = f"phase {progress.phase}, iteration {max(1, progress.iteration)}"
    if progress.round:
        where = (
            f"round {progress.round} of {progress.rounds}, "
            f"iteration {progress.iteration} of {progress.iterations}"
        )
    if not progress.agent:
        where = "whole run"
    stage = f"stage {max(0, progress.stage) + 1} of {progress.stages}"
    eta = progress.eta_seconds if progress.eta_seconds >= 0 else None
    grid.add_row(where, _bar(done, "grey62"), _with_eta(stage, eta))
    return grid


def _learning(state: State, progress: Progress) -> RenderableType:
    grid = Table.grid(padding=(0, 2, 0, 0))
    grid.add_column(no_wrap=True)
    grid.add_column()
    if progress.score_bouts:
        score = Text.assemble(
            (f"{progress.score_mean:+,.0f}", "bold"),
            f"  95 %: {progress.score_low:+,.0f} to {progress.score_high:+,.0f}"
            f", {progress.score_bouts:,} bouts",
        )
    else:
        score = Text("no complete bout in this stage yet", "dim")
    grid.add_row("antagonist's score", score)
    if len(state.scores) > 1:
        grid.add_row("", sparkline(list(state.scores), 48))
    drops = progress.dropped_rollouts
    grid.add_row(
        "samples",
        f"{_short(progress.total_samples)} at {_short(progress.samples_per_s)}/s · policy lag "
        f"{progress.policy_lag_mean:.2f}",
    )
    grid.add_row(
        "PPO",
        Text.assemble(
            f"KL {progress.approx_kl:.4f} · explained variance "
            f"{progress.explained_variance:.2f} · ",
            (f"dropped {drops}", "yellow" if drops else ""),
        ),
    )
    return grid


def _services(state: State) -> RenderableType:
    table = Table(box=None, padding=(0, 2, 0, 0), expand=True, header_style="dim")
    table.add_column("service", no_wrap=True)
    table.add_column("does", ratio=3, no_wrap=True, overflow="ellipsis")
    table.add_column("waits for", ratio=2, no_wrap=True, overflow="ellipsis")
    for heading in ("cpu %", "MiB", "restarts"):
        table.add_column(heading, justify="right", no_wrap=True)
    for name in sorted(state.services):
        row = state.services[name]
        status = row.status
        silent = state.now - row.heard_at
        does = plain(status.state)
        if silent > GONE_SECONDS:
            does = Text(f"silent for {clock_text(silent)}", "bold red")
        elif status.last_error:
            does = plain(status.last_error, "yellow")
        waits = ""
        if status.waiting_for:
            waits = f"{status.waiting_for} {status.waiting_seconds:.0f} s"
        restarts = state.restarts.get(name, 0)
        table.add_row(
            plain(name),
            does,
            plain(waits),
            f"{row.cpu_percent:.0f}",
            f"{status.rss_bytes / MIB:.0f}",
            Text(str(restarts), "yellow" if restarts else "dim"),
        )
    return table


def _event(state: State, at: float, text: str) -> Text:
    elapsed = clock_text(at - state.started_at)
    return Text.assemble((f"{elapsed:>7}  ", "dim"), text, overflow="ellipsis", no_wrap=True)


def _bar(share: float, style: str) -> ProgressBar:
    shown = style or "white"
    return ProgressBar(
        total=1.0, completed=min(1.0, share), complete_style=shown, finished_style=shown
    )


def _done_share(progress: Progress) -> float:
    """Return how much of the run's stages is done, a stage counted as its budget."""
    if not progress.agent:
        return min(1.0, (progress.stage + 1) / max(1, progress.stages))
    within = progress.update / max(1, progress.max_updates)
    return min(1.0, (progress.stage + within) / max(1, progress.stages))


def _with_eta(text: str, eta: float | None) -> str:
    return text if eta is None else f"{text} · {clock_text(eta)} left"


def _score_text(progress: Progress) -> str:
    return (
        f"{progress.score_mean:+.0f} ({progress.score_low:+.0f} to {progress.score_high:+.0f}, "
        f"{progress.score_bouts} bouts)"
    )


def _short(value: float) -> str:
    """Return a count in at most four digits: ``2.41 M``."""
    for size, letter in ((1e9, " G"), (1e6, " M"), (1e3, " k")):
        if abs(value) >= size:
            return f"{value / size:.3g}{letter}"
    return f"{value:.3g}"
