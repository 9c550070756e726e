"""Turns what services say of themselves into curves, a status page and a log of events."""

import dataclasses

from shared.clock import Clock
from shared.messages.league import Schedule
from shared.messages.live import BoutFrames, Progress, ServiceStatus
from shared.messages.training import AGENTS
from shared.telemetry import recording as paths
from shared.telemetry.recording import Level, Recording

MIB = 1 << 20
LONG_WAIT = 10.0
"""Seconds of waiting that are worth a line in the log."""
PROGRESS_CURVES = ("approx_kl", "explained_variance", "policy_lag_mean")
"""Fields of the league's progress that are learning curves."""
CURVE_PERIOD = 2.0
"""Seconds from one point of a learning curve to the next, at least."""
MOST_PROCESSES = 12_000
"""That are kept; the one heard longest ago goes first."""


@dataclasses.dataclass
class _Process:
    """What was heard of one process."""

    status: ServiceStatus
    heard_at: float
    cpu_percent: float = 0.0
    drawn_at: float = -1e9
    said_waiting: bool = False


class Narrator:
    """Logs curves and events; says each thing once."""

    def __init__(self, recording: Recording, clock: Clock, status_period: float) -> None:
        self._recording = recording
        self._clock = clock
        self._status_period = status_period
        self._processes: dict[str, _Process] = {}
        self._progress: Progress | None = None
        self._schedule: Schedule | None = None
        self._point_due = 0.0
        self._stage = ""
        self._message = ""
        self._page = ""
        self._page_due = 0.0

    def say(self, source: str, text: str, level: Level = "INFO") -> None:
        """Add a line to the log of events."""
        self._recording.event(source, text, self._clock.wall_ns(), level)

    def on_bout(self, frames: BoutFrames) -> None:
        """A bout comes on show."""
        players = (
            f"antagonist {_short(frames.antagonist)} v protagonist {_short(frames.protagonist)}"
        )
        self.say("bout", f"bout {frames.bout} of {frames.actor}: {players}")

    def on_progress(self, progress: Progress) -> None:
        """The league says where the run stands."""
        before, self._progress = self._progress, progress
        if progress.message and progress.message != self._message:
            self._message = progress.message
            self.say("league", progress.message)
        wall, samples = self._clock.wall_ns(), progress.total_samples
        agent = progress.agent
        if before is not None and before.agent and before.stage != progress.stage:
            for path in (paths.score_path(before.agent), *_curves(before.agent)):
                self._recording.end_curve(path, wall)
            self._point_due = 0.0
        now = self._clock.now()
        if not agent or now < self._point_due or not progress.update:
            return
        self._point_due = now + CURVE_PERIOD
        if progress.score_bouts:
            score = (progress.score_mean, progress.score_low, progress.score_high)
            self._recording.curve(paths.score_path(agent), score, wall, samples)
        for name in PROGRESS_CURVES:
            value = getattr(progress, name)
            self._recording.curve(paths.training_path(name, agent), value, wall, samples)
        self._recording.curve(paths.THROUGHPUT, progress.samples_per_s, wall, samples)

    def on_schedule(self, schedule: Schedule) -> None:
        """The league says which stage it is."""
        before, self._schedule = self._schedule, schedule
        for agent in AGENTS:
            version = schedule.versions.get(agent)
            if version is not None and (before is None or before.versions.get(agent) != version):
                wall = self._clock.wall_ns()
                self._recording.curve(paths.version_path(agent), float(version), wall)
        stage = schedule.stage
        if schedule.finished:
            text = "training has finished"
        elif stage is None:
            text = "no stage now: evaluation, or a learner has yet to start"
        else:
            text = (
                f"stage {stage.index + 1}: {stage.agent} learns against {_short(stage.opponent)} "
                f"(phase {stage.phase}, iteration {stage.iteration}, "
                f"at most {stage.max_updates} updates)"
            )
        if text != self._stage:
            self._stage = text
            self.say("league", text)

    def on_status(self, status: ServiceStatus) -> None:
        """A process says how it is."""
        now = self._clock.now()
        known = self._processes.pop(status.name, None)  # the newest stands last
        if known is None or known.status.boot != status.boot:
            what = "started" if known is None else "came back as a new process"
            level: Level = "INFO" if known is None else "WARN"
            self.say("services", f"{status.name} {what} (pid {status.pid})", level)
            self._processes[status.name] = _Process(status, now)
            while len(self._processes) > MOST_PROCESSES:
                del self._processes[next(iter(self._processes))]
            return
        self._processes[status.name] = known
        if status.last_error and status.last_error != known.status.last_error:
            self.say("services", f"{status.name}: {status.last_error}", "ERROR")
        waits = status.waiting_seconds > LONG_WAIT
        if waits and not known.said_waiting:
            text = (
                f"{status.name} has waited {status.waiting_seconds:.0f} s for {status.waiting_for}"
            )
            self.say("services", text, "WARN")
        known.said_waiting = waits
        if now > known.heard_at:
            used = status.cpu_seconds - known.status.cpu_seconds
            known.cpu_percent = 100.0 * used / (now - known.heard_at)
        known.status, known.heard_at = status, now

    def tick(self, now: float) -> None:
        """Draw the curves of services and the status page as far as they are due."""
        for name, process in self._processes.items():
            due = now >= process.drawn_at + self._status_period
            if due and process.heard_at > process.drawn_at:
                process.drawn_at = now
                self._draw(name, process)
        if now >= self._page_due and (page := self._status_page()) != self._page:
            self._page, self._page_due = page, now + CURVE_PERIOD
            self._recording.document(paths.LEAGUE_STATE, page, self._clock.wall_ns())

    def _draw(self, name: str, process: _Process) -> None:
        status, wall = process.status, self._clock.wall_ns()
        values = {
            "cpu_percent": process.cpu_percent,
            "rss_mib": status.rss_bytes / MIB,
            "waiting_seconds": status.waiting_seconds,
        }
        for quantity, value in values.items():
            self._recording.curve(paths.service_path(quantity, name), value, wall)
        for rate, value in status.rates.items():
            quantity = "rate" if rate.endswith("_per_s") else "other"
            self._recording.curve(paths.service_path(quantity, f"{name}/{rate}"), value, wall)

    def _status_page(self) -> str:
        progress, schedule = self._progress, self._schedule
        if progress is None:
            return self._stage
        lines = [f"## {progress.run}", "", self._stage, ""]
        rows = [("stage", f"{progress.stage + 1} of {progress.stages}")]
        if progress.agent:
            rows.append(("update", f"{progress.update} of {progress.max_updates}"))
        if progress.score_bouts:
            interval = f"{progress.score_low:+.0f} to {progress.score_high:+.0f}"
            rows.append(
                (
                    "antagonist's score",
                    f"{progress.score_mean:+.0f} ({interval}, {progress.score_bouts} bouts)",
                )
            )
        rows.append(("samples", f"{progress.total_samples:,}"))
        if progress.evaluations_total:
            done, total = progress.evaluations_done, progress.evaluations_total
            rows.append(("evaluation bouts", f"{done:,} of {total:,}"))
        rows.append(("dropped rollouts", str(progress.dropped_rollouts)))
        if schedule is not None:
            rows += [(f"{agent} version", str(v)) for agent, v in schedule.versions.items()]
        lines += ["| | |", "|---|---|", *(f"| {name} | {value} |" for name, value in rows)]
        return "\n".join(lines)


def _curves(agent: str) -> list[str]:
    return [paths.training_path(name, agent) for name in PROGRESS_CURVES]


def _short(player: str) -> str:
    """Return a player reference as people say it."""
    kind, _, rest = player.partition(":")
    return rest[:8] if kind == "sha256" else rest or player
