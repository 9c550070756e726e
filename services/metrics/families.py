"""Which metrics there are, and their samples; dashboards, alerts and scaling use these names."""

from collections.abc import Iterator

from services.metrics.exposition import Family, Sample
from services.metrics.heard import Run, Service
from shared.messages.live import Progress

STARVED = "starved_ms"
"""Counter of a learner: how long it was its turn and too few samples were there (ms)."""
POLICY_LAG = "policy_lag"
"""Rate of a learner: versions between a sample's policy and the one it improved."""
MAX_ON = 64
"""Characters of whom a service waits for."""

INFO = Family("riposte_service_info", "gauge", "1 for each process; its labels say which it is.")
SEEN = Family(
    "riposte_service_last_seen_seconds", "gauge", "Since the process last said how it is (s)."
)
RESTARTS = Family(
    "riposte_service_restarts_total", "counter", "Times a process came back under the same name."
)
RATE = Family(
    "riposte_service_rate", "gauge", "What a process measures of itself, by name with unit."
)
EVENTS = Family(
    "riposte_service_events_total", "counter", "What a process counts, drops and losses among it."
)
WAITING = Family(
    "riposte_service_waiting_seconds", "gauge", "How long a process has waited, and for whom (s)."
)
ERROR = Family("riposte_service_error", "gauge", "1 when a process has something to complain of.")
CPU = Family("riposte_service_cpu_seconds_total", "counter", "Processor time of a process (s).")
MEMORY = Family("riposte_service_memory_bytes", "gauge", "Resident memory of a process (bytes).")
STARVATION = Family(
    "riposte_learner_starved_seconds_total", "counter",
    "Time a learner waited for samples in its turn (s); its rate is the fraction of time.",
)  # fmt: skip
STALENESS = Family(
    "riposte_learner_policy_lag_versions", "gauge",
    "Versions between the policy that made the samples of the last update and the one improved.",
)  # fmt: skip

RUN_INFO = Family("riposte_run_info", "gauge", "1 for the run; its labels say what it does now.")
RUN_SEEN = Family(
    "riposte_run_last_seen_seconds", "gauge", "Since the league last said where the run stands (s)."
)
RUN_SCORE = Family(
    "riposte_run_score", "gauge",
    "Antagonist's mean score over the latest bouts of the stage, and its 95 % interval.",
)  # fmt: skip
RUN_GAUGES: dict[str, Family] = {
    field: Family(f"riposte_run_{name}", "gauge", about)
    for field, name, about in (
        ("stage", "stage", "Stage of the run, from 0."),
        ("stages", "stages", "Stages of the run."),
        ("iteration", "iteration", "Iteration of the phase."),
        ("round", "round", "Round of phase two; 0 in phase one."),
        ("update", "update", "Updates made in this stage."),
        ("max_updates", "max_updates", "Most updates of this stage."),
        ("samples_per_s", "samples_per_second", "Samples learned from (1/s)."),
        ("policy_lag_mean", "policy_lag_versions", "Mean policy lag of the last update."),
        ("approx_kl", "approx_kl", "Approximate KL divergence of the last update (nat)."),
        ("explained_variance", "explained_variance", "Of the critic, in the last update."),
        ("score_bouts", "score_bouts", "Bouts behind riposte_run_score."),
        ("evaluations_done", "evaluations_done", "Evaluation bouts played."),
        ("evaluations_total", "evaluations", "Evaluation bouts to play."),
    )
}
RUN_ETA = Family("riposte_run_eta_seconds", "gauge", "Time left (s); absent while unknown.")
RUN_SAMPLES = Family("riposte_run_samples_total", "counter", "Samples learned from.")
RUN_DROPPED = Family(
    "riposte_run_dropped_rollouts_total", "counter", "Rollouts thrown away, being too old."
)

REFUSED = Family(
    "riposte_metrics_refused_total", "counter", "Messages that could not be shown as metrics."
)

FAMILIES = (
    INFO, SEEN, RESTARTS, RATE, EVENTS, WAITING, ERROR, CPU, MEMORY, STARVATION, STALENESS,
    RUN_INFO, RUN_SEEN, RUN_SCORE, *RUN_GAUGES.values(), RUN_ETA, RUN_SAMPLES, RUN_DROPPED, REFUSED,
)  # fmt: skip


def samples_of(service: Service, now: float) -> Iterator[Sample]:
    """Return the samples of one process; ``now`` is by the clock it was heard by (s)."""
    status = service.status
    who = {"role": status.role, "name": status.name}
    about = {"host": status.host, "version": status.version, "boot": status.boot}
    yield Sample(INFO, who | about, 1.0)
    yield Sample(SEEN, who, max(now - service.heard_at, 0.0))
    yield Sample(RESTARTS, who, service.restarts)
    yield Sample(ERROR, who, bool(status.last_error))
    yield Sample(CPU, who, status.cpu_seconds)
    yield Sample(MEMORY, who, status.rss_bytes)
    if status.waiting_for:
        on = status.waiting_for.partition(":")[0][:MAX_ON]
        yield Sample(WAITING, {**who, "on": on}, status.waiting_seconds)
    for rate, value in sorted(status.rates.items()):
        yield Sample(RATE, {**who, "rate": rate}, value)
    for counter, value in sorted(status.counters.items()):
        yield Sample(EVENTS, {**who, "counter": counter}, value)
    if status.role == "learner" and STARVED in status.counters:
        yield Sample(STARVATION, who, status.counters[STARVED] / 1e3)
    if status.role == "learner" and POLICY_LAG in status.rates:
        yield Sample(STALENESS, who, status.rates[POLICY_LAG])


def samples_of_run(run: Run, now: float) -> Iterator[Sample]:
    """Return the samples of the run."""
    progress: Progress = run.progress
    which = {"run": progress.run}
    yield Sample(RUN_INFO, {**which, "phase": progress.phase, "agent": progress.agent}, 1.0)
    yield Sample(RUN_SEEN, which, max(now - run.heard_at, 0.0))
    for field, family in RUN_GAUGES.items():
        yield Sample(family, which, getattr(progress, field))
    if progress.score_bouts:
        for bound in ("mean", "low", "high"):
            value = getattr(progress, f"score_{bound}")
            yield Sample(RUN_SCORE, {**which, "bound": bound}, value)
    if progress.eta_seconds >= 0:
        yield Sample(RUN_ETA, which, progress.eta_seconds)
    yield Sample(RUN_SAMPLES, which, progress.total_samples)
    yield Sample(RUN_DROPPED, which, progress.dropped_rollouts)
