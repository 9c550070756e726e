"""How `riposte status` looks: pure functions of what was heard, one table, grouped by host."""

from collections.abc import Iterable, Sequence

import msgspec
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from services.jobs.plain import plain, printable
from shared.messages.live import Progress, ServiceStatus

SILENT_SECONDS = 3.0
"""A process that has said nothing for this long is called silent: it should every second."""
RATES = 6
"""Of one process that are shown; `--json` has all."""
STATE_WIDTH = 34


class Heard(msgspec.Struct, frozen=True, kw_only=True):
    """One process as it was last heard."""

    status: ServiceStatus
    silent_seconds: float
    """Since then."""
    cpu_percent: float | None = None
    """Of one processor, between its latest two reports; None with fewer."""
    lags: dict[str, int] = {}
    """By agent, how many versions its newest policy is behind the newest there is."""


class Missing(msgspec.Struct, frozen=True, kw_only=True):
    """A process that should be there and was never heard."""

    name: str
    role: str
    why: str
    """How it is known all the same."""


class Snapshot(msgspec.Struct, frozen=True, kw_only=True):
    """What was heard of a run."""

    processes: tuple[Heard, ...] = ()
    missing: tuple[Missing, ...] = ()
    progress: Progress | None = None

    @property
    def services(self) -> tuple[ServiceStatus, ...]:
        """Return what every process said last."""
        return tuple(heard.status for heard in self.processes)


def lags(statuses: Iterable[ServiceStatus], own: ServiceStatus) -> dict[str, int]:
    """Return how far the policies that a process has are behind the newest that anybody has."""
    newest: dict[str, int] = {}
    for status in statuses:
        for agent, version in status.policies.items():
            newest[agent] = max(version, newest.get(agent, version))
    return {agent: newest[agent] - version for agent, version in own.policies.items()}


def headline(progress: Progress) -> str:
    """Return where the run stands, in one line."""
    parts = [f"{progress.run}: phase {progress.phase}"]
    if progress.iteration:
        parts.append(f"iteration {progress.iteration}")
    if progress.agent:
        parts += [
            f"stage {progress.stage + 1}/{progress.stages}",
            f"{progress.agent} learns",
            f"update {progress.update}/{progress.max_updates}",
        ]
    if progress.evaluations_total:
        parts.append(f"evaluations {progress.evaluations_done}/{progress.evaluations_total}")
    if progress.score_bouts:
        low, high = progress.score_low, progress.score_high
        parts.append(f"score {progress.score_mean:.0f} [{low:.0f}, {high:.0f}]")
    if progress.samples_per_s:
        parts.append(f"{progress.samples_per_s:.0f} samples/s")
        parts.append(f"policy lag {progress.policy_lag_mean:.2f}")
    if progress.dropped_rollouts:
        parts.append(f"dropped rollouts {progress.dropped_rollouts}")
    if progress.eta_seconds >= 0:
        minutes, rest = divmod(round(progress.eta_seconds), 60)
        parts.append(f"{minutes}:{rest:02d} left")
    return ", ".join(parts)


def render(snapshot: Snapshot) -> RenderableType:
    """Return everything that a person is shown."""
    parts: list[RenderableType] = []
    if snapshot.progress is not None:
        parts.append(plain(headline(snapshot.progress)))
    parts.append(table(snapshot))
    codes = sorted({code(status) for status in snapshot.services})
    if len(codes) > 1:
        parts.append(plain(f"different code is running: {', '.join(codes)}", "yellow"))
    return Group(*parts)


def table(snapshot: Snapshot) -> Table:
    """Return one row for each process, under its host; first the host most of them are on."""
    made = Table(box=None, pad_edge=False, header_style="bold")
    made.add_column("process", no_wrap=True)
    made.add_column("does", max_width=STATE_WIDTH)
    made.add_column("waits for", max_width=STATE_WIDTH)
    made.add_column("policy", no_wrap=True)
    made.add_column("rates", no_wrap=True)
    made.add_column("dropped", no_wrap=True)
    made.add_column("cpu", justify="right", no_wrap=True)
    made.add_column("memory", justify="right", no_wrap=True)
    made.add_column("last error", style="red", max_width=40)
    hosts: dict[str, list[Heard]] = {}
    for heard in snapshot.processes:
        hosts.setdefault(heard.status.host, []).append(heard)
    for host in sorted(hosts, key=lambda name: (-len(hosts[name]), name)):
        rows = hosts[host]
        codes = sorted({code(heard.status) for heard in rows})
        made.add_row(plain(host, "bold cyan"), plain(", ".join(codes), "dim"))
        for heard in sorted(rows, key=lambda one: (one.status.role, one.status.name)):
            made.add_row(*_cells(heard))
    if snapshot.missing:
        made.add_row(Text("not heard", style="bold red"))
    for missing in snapshot.missing:
        made.add_row(plain(f"  {missing.name}"), plain(missing.why, "red"))
    return made


def _cells(heard: Heard) -> Sequence[RenderableType]:
    status = heard.status
    state = plain(status.state)
    if heard.silent_seconds >= SILENT_SECONDS:
        state = plain(f"silent for {heard.silent_seconds:.0f} s, then: {status.state}", "red")
    policies = sorted(status.policies.items())
    rates = sorted(status.rates.items())[:RATES]
    return (
        plain(f"  {status.name}"),
        state,
        plain(waits(status)),
        _lines(policy_text(agent, number, heard.lags.get(agent, 0)) for agent, number in policies),
        _lines(rate_text(name, value) for name, value in rates),
        _lines(f"{name} {count:,}" for name, count in drops(status).items()),
        "" if heard.cpu_percent is None else f"{heard.cpu_percent:.0f} %",
        f"{status.rss_bytes / 2**20:.0f} MiB",
        plain(status.last_error),
    )


def _lines(texts: Iterable[str]) -> Text:
    return Text("\n".join(map(printable, texts)))


def code(status: ServiceStatus) -> str:
    """Return which code a process runs."""
    version = status.version or "version unknown"
    return f"{version} ({status.commit})" if status.commit else version


def policy_text(agent: str, version: int, lag: int) -> str:
    """Return a policy's version, and how far it is behind."""
    return f"{agent} {version}" + (f" (-{lag})" if lag else "")


def rate_text(name: str, value: float) -> str:
    """Return a rate with its unit, which its name ends with."""
    for ending, unit in (("_per_s", "/s"), ("_ms", " ms"), ("_seconds", " s"), ("_hz", " Hz")):
        if name.endswith(ending):
            digits = 0 if abs(value) >= 100 else 2
            return f"{name.removesuffix(ending).replace('_', ' ')} {value:,.{digits}f}{unit}"
    return f"{name.replace('_', ' ')} {value:,.2f}"


def waits(status: ServiceStatus) -> str:
    """Return whom a service waits for and since when."""
    if not status.waiting_for:
        return ""
    return f"{status.waiting_for} for {status.waiting_seconds:.1f} s"


def drops(status: ServiceStatus) -> dict[str, int]:
    """Return the counters that say something was lost or refused, those above zero."""
    words = ("drop", "refus", "lost", "reconnect")
    return {
        name: count
        for name, count in sorted(status.counters.items())
        if count > 0 and any(word in name for word in words)
    }
