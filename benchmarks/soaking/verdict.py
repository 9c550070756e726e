"""What the samples of a soak say: slopes with intervals, each against its limit."""

import dataclasses
import statistics
from collections.abc import Callable, Sequence
from typing import Literal

from benchmarks.slopes import Slope, slope
from benchmarks.soaking.samples import Sample

Outcome = Literal["met", "missed", "undecided"]
HOUR = 3600.0
MEMORY_LIMIT = 4.0
"""MB an hour that a process may grow: about 100 MB a day."""
COUNT_LIMIT = 1.0
"""File handles, or threads, an hour."""
LATENESS_LIMIT = 1.0
"""Milliseconds an hour by which the 99th percentile of the control's lateness may grow."""
LATE_SHARE_LIMIT = 0.01
"""Of the control ticks: more than 10 ms late, or lost."""
RATE_LIMIT = 0.05
"""Share of the training rate that may go lost in an hour."""
REFERENCE = "play/robot-io-0"
"""A process whose work in a tick is always the same: when it costs more, the machine is slower."""
WARM_UP_SHARE, LEAST_WARM_UP, MOST_WARM_UP = 0.1, 30.0, 600.0
"""Of a soak are left out of all slopes: caches fill, allocators settle (share; s; s)."""

LEAST_JUDGED = 1800.0
"""A soak shorter than this (s) is too early for slopes: what grows and what only settles look the
same, so they are undecided at best."""


@dataclasses.dataclass(frozen=True)
class Criterion:
    """One figure, its limit, and whether it is kept."""

    name: str
    value: str
    limit: str
    outcome: Outcome


@dataclasses.dataclass(frozen=True)
class Verdict:
    """What came of a soak."""

    criteria: tuple[Criterion, ...]
    seconds: float
    samples: int
    warm_up: float
    """Seconds left out at the beginning."""
    rate: float
    """Training samples a second."""
    bouts: int
    growth: tuple[tuple[str, Slope, float], ...]
    """Of each process: its name, its memory's slope (MB/h), and its memory at the end (MB)."""
    disk_mb_per_hour: dict[str, float]
    ended: str
    """Why it ended early; empty when it did not."""
    as_measured: str
    """How the training rate changed, and what the reference's tick cost, in words."""

    @property
    def outcome(self) -> Outcome:
        """Return met only when every criterion is met."""
        outcomes = {criterion.outcome for criterion in self.criteria}
        return (
            "missed" if "missed" in outcomes else "undecided" if "undecided" in outcomes else "met"
        )


def judged(low: float, high: float, limit: float) -> Outcome:
    """Return whether a value known to lie in an interval is at most a limit."""
    return "met" if high <= limit else "missed" if low > limit else "undecided"


def hourly(found: Slope) -> Slope:
    """Return a slope in units an hour."""
    return dataclasses.replace(
        found, value=found.value * HOUR, low=found.low * HOUR, high=found.high * HOUR
    )


def warm_up_of(seconds: float) -> float:
    """Return how much of a soak of this length counts as warm-up (s)."""
    return min(max(WARM_UP_SHARE * seconds, LEAST_WARM_UP), MOST_WARM_UP)


def judge(samples: Sequence[Sample], ended: str = "") -> Verdict:
    """Return the verdict on a soak.

    Args:
        samples: oldest first.
        ended: why it ended early.

    Raises:
        ValueError: there are too few samples for a slope after the warm-up.
    """
    if not samples:
        raise ValueError("no sample: the soak was killed before the first")
    seconds = samples[-1].at - samples[0].at
    warm_up = warm_up_of(seconds)
    kept = [sample for sample in samples if sample.at >= samples[0].at + warm_up]
    if len(kept) < 8:
        raise ValueError(
            f"{len(kept)} samples after a warm-up of {warm_up:.0f} s: a slope needs at least 8"
        )
    names = sorted(kept[-1].processes)
    growth = tuple(
        (name, hourly(found), kept[-1].processes[name].rss_bytes / 1e6)
        for name in names
        if (found := _of_process(kept, name, lambda use: use.rss_bytes / 1e6)) is not None
    )
    rates = _rates(kept)
    slopes = [
        *(_grows(f"memory of {name}", found, MEMORY_LIMIT, "MB/h") for name, found, _ in growth),
        _counts(kept, names, "file handles", "files"),
        _counts(kept, names, "threads", "threads"),
        _lateness(kept),
        *_rate_criteria(rates),
    ]
    if seconds < LEAST_JUDGED:
        slopes = [dataclasses.replace(one, outcome="undecided") for one in slopes]
    criteria = [_ended(ended), _same_processes(kept), *_late_ticks(kept), *slopes]
    return Verdict(
        criteria=tuple(criteria),
        seconds=seconds,
        samples=len(samples),
        warm_up=warm_up,
        rate=sum(one.rate for one in rates) / max(len(rates), 1),
        bouts=samples[-1].bouts,
        growth=growth,
        disk_mb_per_hour=_disk(kept),
        ended=ended,
        as_measured=_as_measured(rates),
    )


def _ended(ended: str) -> Criterion:
    said = ended.splitlines()[0] if ended else "it ran to its end"
    return Criterion("nothing ended it early", said, "-", "missed" if ended else "met")


def _same_processes(kept: Sequence[Sample]) -> Criterion:
    first, last = kept[0].processes, kept[-1].processes
    changed = [name for name in first if name not in last or last[name].pid != first[name].pid]
    return Criterion(
        "processes that died", ", ".join(changed) or "none", "none", "missed" if changed else "met"
    )


def _of_process(kept: Sequence[Sample], name: str, value: Callable[..., float]) -> Slope | None:
    pairs = [(s.at, value(s.processes[name])) for s in kept if name in s.processes]
    return slope([at for at, _ in pairs], [found for _, found in pairs])


def _grows(name: str, found: Slope, limit: float, unit: str) -> Criterion:
    return Criterion(
        name, _text(found, unit), f"at most {limit:g} {unit}", judged(found.low, found.high, limit)
    )


def _counts(kept: Sequence[Sample], names: Sequence[str], what: str, field: str) -> Criterion:
    """Return the criterion of the process that takes the most of something, growing."""
    worst_name, worst = "", None
    for name in names:
        found = _of_process(kept, name, lambda use: float(getattr(use, field)))
        if found is not None and (worst is None or found.high > worst.high):
            worst_name, worst = name, found
    assert worst is not None  # there are processes, and samples enough
    return _grows(f"{what}, {worst_name} (the worst)", hourly(worst), COUNT_LIMIT, "/h")


def _lateness(kept: Sequence[Sample]) -> Criterion:
    pairs = [(s.at, s.lateness_ms[1]) for s in kept if s.lateness_ms is not None]
    found = slope([at for at, _ in pairs], [late for _, late in pairs])
    name = "lateness of the control, p99"
    if found is None:
        return Criterion(name, "not heard", f"at most {LATENESS_LIMIT:g} ms/h", "missed")
    return _grows(name, hourly(found), LATENESS_LIMIT, "ms/h")


def _late_ticks(kept: Sequence[Sample]) -> list[Criterion]:
    ticks = kept[-1].ticks - kept[0].ticks
    bad = kept[-1].ticks_late + kept[-1].ticks_lost - kept[0].ticks_late - kept[0].ticks_lost
    if ticks <= 0:
        return [Criterion("control ticks", "none", "100 a second", "missed")]
    share = bad / ticks
    return [
        Criterion(
            "control ticks over 10 ms late, or lost", f"{share:.2%} of {ticks:,}",
            f"at most {LATE_SHARE_LIMIT:.0%}", "met" if share <= LATE_SHARE_LIMIT else "missed",
        )
    ]  # fmt: skip


@dataclasses.dataclass(frozen=True)
class _Stretch:
    """A minute of training."""

    at: float
    """Its middle (s)."""
    rate: float
    """Samples a second."""
    tick_cost: float
    """CPU seconds of the reference for a control tick; 0 where it did not run."""


def _rates(kept: Sequence[Sample]) -> list[_Stretch]:
    """Return the training rate between versions.

    Samples of a soak come more often than versions, or not; only stretches of a minute say much.
    """
    made: list[_Stretch] = []
    begin = kept[0]
    stretch = min(60.0, (kept[-1].at - kept[0].at) / 8)
    for sample in kept[1:]:
        if sample.at - begin.at >= stretch:
            samples = (sample.version - begin.version) * sample.batch_samples
            rate = samples / (sample.at - begin.at)
            made.append(_Stretch((sample.at + begin.at) / 2, rate, _tick_cost(begin, sample)))
            begin = sample
    return made


def _tick_cost(begin: Sample, end: Sample) -> float:
    one, other = (it.processes.get(REFERENCE) for it in (begin, end))
    ticks = (end.ticks - end.ticks_lost) - (begin.ticks - begin.ticks_lost)
    if one is None or other is None or one.pid != other.pid or ticks <= 0:
        return 0.0
    return (other.cpu_seconds - one.cpu_seconds) / ticks


def _rate_criteria(stretches: Sequence[_Stretch]) -> list[Criterion]:
    """Return the criteria on the training rate: as it was, and at the machine's median speed.

    Where the same work costs a tenth more CPU than in the median, the machine is a tenth slower,
    and so is a training that takes all of its core.
    """
    times, costs = [one.at for one in stretches], [one.tick_cost for one in stretches]
    found = [_rate("loss of training rate", times, [one.rate for one in stretches])]
    if costs and min(costs) > 0.0:
        usual = statistics.median(costs)
        rates = [one.rate * one.tick_cost / usual for one in stretches]
        found.append(_rate("the same, at the machine's median speed", times, rates))
    return found


def _rate(name: str, times: Sequence[float], rates: Sequence[float]) -> Criterion:
    loss = _loss(times, rates)
    if loss is None:
        return Criterion("training rate", "nothing was learned", "more than 0", "missed")
    return Criterion(
        name, _text(loss, "an hour", percent=True), f"at most {RATE_LIMIT:.0%} an hour",
        judged(loss.low, loss.high, RATE_LIMIT),
    )  # fmt: skip


def _as_measured(stretches: Sequence[_Stretch]) -> str:
    times = [one.at for one in stretches]
    loss = _loss(times, [one.rate for one in stretches])
    less = _loss(times, [one.tick_cost for one in stretches])
    if loss is None or less is None:
        return ""
    rate, cost = (
        _text(dataclasses.replace(one, value=-one.value, low=-one.high, high=-one.low), "an hour",
              percent=True)
        for one in (loss, less)
    )  # fmt: skip
    return (
        f"As it was measured, the training rate changed by {rate}, while the CPU of a control "
        f"tick, whose work is always the same, changed by {cost}: so did the machine's speed"
    )


def _loss(times: Sequence[float], values: Sequence[float]) -> Slope | None:
    """Return by which share of its mean a series falls in an hour."""
    found = slope(times, values)
    if found is None or found.mean <= 0.0:
        return None
    share = HOUR / found.mean
    return dataclasses.replace(
        found, value=-found.value * share, low=-found.high * share, high=-found.low * share
    )


def _disk(kept: Sequence[Sample]) -> dict[str, float]:
    found: dict[str, float] = {}
    for job in kept[-1].disk_bytes:
        line = slope([s.at for s in kept], [s.disk_bytes[job] / 1e6 for s in kept])
        if line is not None:
            found[job] = line.value * HOUR
    return found


def _text(found: Slope, unit: str, *, percent: bool = False) -> str:
    form = "+.1%" if percent else "+.2f"
    return f"{found.value:{form}} [{found.low:{form}}, {found.high:{form}}] {unit}"
