"""A soak's verdict as text, and its block in ``docs/reliability.md``."""

from pathlib import Path

from benchmarks.soaking.samples import Kept
from benchmarks.soaking.verdict import (
    COUNT_LIMIT,
    LATE_SHARE_LIMIT,
    LATENESS_LIMIT,
    MEMORY_LIMIT,
    RATE_LIMIT,
    Verdict,
)
from shared.runtime.files import atomic_write

BEGIN, END = "<!-- soak:begin -->", "<!-- soak:end -->"
SECTION = "\n## Soak\n"
MARKS = {"met": "✓", "missed": "✗", "undecided": "?"}


def text_of(verdict: Verdict) -> str:
    """Return the verdict as a person reads it."""
    lines = [
        f"soak: {verdict.outcome} after {verdict.seconds / 60:.1f} minutes, {verdict.samples} "
        f"samples, {verdict.rate:,.0f} training samples/s, {verdict.bouts} bouts"
    ]
    lines += [
        f"  {MARKS[one.outcome]} {one.name:<48} {one.value} ({one.limit})"
        for one in verdict.criteria
    ]
    disk = ", ".join(f"{job} {rate:.0f} MB/h" for job, rate in verdict.disk_mb_per_hour.items())
    return "\n".join([*lines, f"    {verdict.as_measured}", f"    disk: {disk}"])


def block_of(verdict: Verdict, kept: Kept) -> str:
    """Return the block of the page.

    Args:
        verdict: of the soak.
        kept: it was made from.
    """
    started = kept.started
    loads = sorted(one.load for one in kept.samples)
    command = f"make soak SOAK_MINUTES={started.minutes:g}"
    disk = ", ".join(f"{job} {rate:.0f} MB/h" for job, rate in verdict.disk_mb_per_hour.items())
    rows = [
        f"| {one.name} | {one.value} | {one.limit} | {one.outcome} |" for one in verdict.criteria
    ]
    return "\n".join([
        f"**{verdict.outcome}**: `{command}`, commit {started.commit}, "
        f"{verdict.seconds / 60:.0f} minutes on {started.cores} cores of an {started.processor}, "
        f"load average {loads[len(loads) // 2]:.1f} (median; the soak itself makes about 3): "
        f"{verdict.samples} samples, the first {verdict.warm_up:.0f} s left out as warm-up; "
        f"{verdict.rate:,.0f} training samples/s, {verdict.bouts} bouts. Disk: {disk}.",
        "",
        "| Figure | Measured | Limit | Outcome |",
        "|---|---|---|---|",
        *rows,
        "",
        "Training (router, league, two learners, an actor, a recorder) and a match of two policies "
        "(router, robot_io with the twin, policies, referee, recorder) run together, the match on "
        "one core and the training on the others. Slopes are straight lines through the means of "
        "20 equal blocks, with Student's 95 % interval. A criterion is *met* when the whole "
        "interval keeps its limit, *missed* when the whole interval breaks it, else *undecided*; "
        "the soak is met when all are. A soak of less than half an hour only shows that it runs: "
        "its slopes are undecided, whatever they are. Machines in a cloud change their speed by "
        "the hour: the training rate is judged as it was and at the machine's median speed, by "
        f"what a control tick of robot_io costs. {verdict.as_measured}.",
        "",
        f"Limits: {MEMORY_LIMIT:g} MB an hour of memory in each process; {COUNT_LIMIT:g} file "
        f"handle and thread an hour; {LATENESS_LIMIT:g} ms an hour of the control's lateness (99th "
        f"percentile); {LATE_SHARE_LIMIT:.0%} of the ticks late or lost; {RATE_LIMIT:.0%} of the "
        "training rate an hour; no process dies.",
    ])  # fmt: skip


def write(page: Path, block: str) -> None:
    """Put the block into the page's section *Soak*; begin page or section where there is none."""
    text = page.read_text(encoding="utf-8") if page.exists() else "# Reliability\n"
    before, found, rest = text.partition(BEGIN)
    _, closed, after = rest.partition(END)
    if not (found and closed):
        before, section, after = text.partition(SECTION)
        before = f"{before.rstrip()}\n{SECTION}\n"
        after = after if section else "\n"
    atomic_write(page, f"{before}{BEGIN}\n{block}\n{END}{after}".encode())
