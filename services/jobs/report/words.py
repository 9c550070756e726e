"""A run's numbers in words: the headline, and the screen that `riposte train` ends with."""

import textwrap

from services.jobs.report.rounds import Estimate
from services.jobs.report.summary import Difference, Meeting, Score, Summary

WIDTH = 78


def headline(summary: Summary) -> str:
    """Return in one or two sentences what was trained, how long, and what came of it."""
    iterations = max((stage.iteration for stage in summary.stages), default=0)
    times = "one iteration" if iterations == 1 else f"{iterations} iterations"
    effort = f"{count_text(summary.samples)} samples in {duration_text(summary.seconds)}"
    if not summary.finished:
        running = next((s for s in reversed(summary.stages) if s.ended == "no"), None)
        where = "between stages" if summary.stages else "no stage has begun"
        if summary.rounds:
            newest = summary.rounds[-1]
            turn = newest.turns[-1]
            where = f"in round {newest.round}, iteration {turn.iteration}, {turn.agent} learns"
        elif running is not None:
            where = (
                f"in stage {running.index + 1}, {running.agent} at update {running.updates} "
                f"of {running.max_updates}"
            )
        elif summary.meetings:
            played = sum(meeting.bouts for meeting in summary.meetings)
            planned = sum(meeting.planned for meeting in summary.meetings)
            where = f"in the evaluation, {played:,} of {planned:,} bouts played"
        return f"Not finished: {where}, after {effort}."
    text = f"Phase one, {times}, both fencers trained from nothing on {effort}"
    if summary.rounds:
        rounds = "one round" if len(summary.rounds) == 1 else f"{len(summary.rounds)} rounds"
        played = summary.rounds[-1].turns[-1].iteration
        text = (
            f"Phase one, {times}, and phase two, {rounds} of {played} iterations, "
            f"trained on {effort}"
        )
    parts = [_claim(difference) for difference in summary.headline_differences]
    return f"{text}: {', and '.join(parts)}." if parts else f"{text}."


def duration_text(seconds: float) -> str:
    """Return a duration in words."""
    whole = max(0, round(seconds))
    if whole < 60:
        return f"{whole} s"
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def count_text(value: float) -> str:
    """Return a count in words: ``9.83 million``."""
    if value >= 1e6:
        return f"{value / 1e6:.3g} million"
    return f"{value:,.0f}"


def points_text(value: float, *, sign: bool = True) -> str:
    """Return points, with a proper minus and thousands set apart."""
    text = f"{value:+,.0f}" if sign else f"{value:,.0f}"
    return "0" if text in ("+0", "-0") else text.replace("-", "\N{MINUS SIGN}")


def interval_text(score: Score, *, sign: bool = True) -> str:
    """Return the 95 % interval of a score."""
    return f"{points_text(score.low, sign=sign)} to {points_text(score.high, sign=sign)}"


def _claim(difference: Difference) -> str:
    score = difference.score
    size = f"{points_text(abs(score.mean), sign=False)} points a bout"
    reach = f"95 %: {interval_text(score, sign=False)}"
    goal = "goal met" if difference.met else f"short of {points_text(difference.goal, sign=False)}"
    if difference.kind == "lowers":
        does = f"takes {size} off" if score.mean >= 0 else f"gives {size} more to"
        who = f"protagonist {difference.iteration} {does} the antagonist it trained against"
    else:
        does = f"wins {size} back from" if score.mean >= 0 else f"loses {size} more against"
        who = f"antagonist {difference.iteration + 1} {does} protagonist {difference.iteration}"
    return f"{who} ({reach}; {goal})"


def summary_text(summary: Summary) -> str:
    """Return the summary of a run on one screen."""
    lines = ["", *textwrap.wrap(headline(summary), WIDTH), ""]
    if summary.stages:
        lines.append("stage                       updates   samples     time  score: first    last")
    for stage in summary.stages:
        name = f"{stage.index + 1}  {stage.agent} {stage.iteration}"
        lines.append(
            f"{name:<26}{stage.updates:>9}{_short(stage.samples):>10}"
            f"{clock_text(stage.seconds):>9}{_mean(stage.first):>14}{_mean(stage.last):>8}"
        )
    if summary.rounds:
        lines += [
            "",
            "round                       updates   samples     time  score: first    last",
        ]
    for played in summary.rounds:
        lines.append(
            f"{played.round:<26}{played.updates:>9}{_short(played.samples):>10}"
            f"{clock_text(played.seconds):>9}{_mean(played.first):>14}{_mean(played.last):>8}"
        )
    if summary.meetings:
        lines += ["", *_matrix(summary)]
    if summary.differences:
        lines.append("")
    for difference in summary.differences:
        mark = "met " if difference.met else "short"
        lines.append(
            f"{mark:<6}{difference.text}: {points_text(difference.score.mean)} "
            f"({interval_text(difference.score)}; goal {points_text(difference.goal, sign=False)})"
        )
    happened = ", ".join(f"{n} x {what.replace('_', ' ')}" for what, n in _counts(summary))
    lines += [
        "",
        f"{count_text(summary.samples_per_s)} samples/s while training; "
        f"happened: {happened or 'nothing out of the ordinary'}",
        f"report     {summary.folder}/report.html",
        f"recording  riposte watch {summary.folder}",
    ]
    return "\n".join(lines)


def clock_text(seconds: float) -> str:
    """Return a duration as ``4:07`` or ``1:02:33``."""
    whole = max(0, round(seconds))
    if whole >= 3600:
        return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"
    return f"{whole // 60}:{whole % 60:02d}"


def percent_text(share: float) -> str:
    """Return a share in percent, a small one with a decimal."""
    return f"{100 * share:.1f} %" if 0 < share < 0.1 else f"{100 * share:.0f} %"


def players(meetings: tuple[Meeting, ...]) -> tuple[list[str], list[str]]:
    """Return the antagonists and the protagonists of an evaluation, in order."""
    antagonists = list(dict.fromkeys(meeting.antagonist for meeting in meetings))
    protagonists = list(dict.fromkeys(meeting.protagonist for meeting in meetings))
    return antagonists, protagonists


def _matrix(summary: Summary) -> list[str]:
    antagonists, protagonists = players(summary.meetings)
    by_names = {(m.antagonist, m.protagonist): m for m in summary.meetings}
    width = 20
    lines = [f"{'score a bout (95 %)':<20}" + "".join(f"{'v ' + p:>{width}}" for p in protagonists)]
    for antagonist in antagonists:
        cells: list[str] = []
        for protagonist in protagonists:
            meeting = by_names.get((antagonist, protagonist))
            text = "-"
            if meeting is not None and meeting.score is not None:
                score = meeting.score
                half = (score.high - score.low) / 2
                text = f"{points_text(score.mean)} \N{PLUS-MINUS SIGN} {half:,.0f}"
            cells.append(f"{text:>{width}}")
        lines.append(f"{antagonist:<20}" + "".join(cells))
    shares = [meeting.camping_share for meeting in summary.meetings if meeting.bouts]
    if shares:
        lines.append(f"points from camping: at most {percent_text(max(shares))} of any pairing's")
    return lines


def _counts(summary: Summary) -> list[tuple[str, int]]:
    found = sorted(summary.incident_counts.items(), key=lambda item: (-item[1], item[0]))
    if summary.leases_lapsed:
        found.append(("lease_lapsed", summary.leases_lapsed))
    return found


def _mean(score: Score | Estimate | None) -> str:
    return points_text(score.mean) if score is not None else "-"


def _short(value: float) -> str:
    return f"{value / 1e6:.2f} M" if value >= 1e6 else f"{value:,.0f}"
