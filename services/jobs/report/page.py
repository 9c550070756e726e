"""The HTML report of a run, from its summary, its figures and its pictures."""

import dataclasses
from collections.abc import Sequence

from services.jobs.report.pictures import Picture
from services.jobs.report.summary import Difference, Meeting, Summary
from services.jobs.report.words import (
    clock_text,
    count_text,
    duration_text,
    headline,
    interval_text,
    percent_text,
    players,
    points_text,
)
from shared.telemetry import html
from shared.telemetry.figures import Panel, StageCurve, learning_curve, training_panels
from shared.telemetry.html import Html, Node, tag

MOST_INCIDENTS = 100
HEAT = {True: "217, 83, 44", False: "53, 118, 196"}
"""Red, green, blue of a score the antagonist, or the protagonist, can be content with."""


@dataclasses.dataclass(frozen=True)
class Extras:
    """What the page shows besides the summary."""

    pictures: Sequence[Picture]
    panels: Sequence[Panel]
    """Training health over time."""
    config: str
    """The resolved configuration, TOML."""
    files: Sequence[tuple[str, str]]
    """What lies in the run's folder, and what it is."""


def report_page(summary: Summary, extras: Extras) -> str:
    """Return the whole page."""
    sections: list[Node] = [
        _head(summary),
        _learning(summary),
        _evaluation(summary),
        _pictures(extras.pictures),
        _health(summary, extras.panels),
        _happened(summary),
        _again(summary, extras),
        tag("footer", f"Riposte {summary.origin.packages.get('riposte', '')}, run {summary.run}."),
    ]
    return html.page(f"Riposte: {summary.run}", *sections)


def _head(summary: Summary) -> Node:
    tiles: list[tuple[Node, Node, str]] = []
    for difference in summary.headline_differences:
        colour = "good" if difference.met else "bad"
        about = "protagonist takes" if difference.kind == "lowers" else "antagonist wins back"
        goal = points_text(difference.goal, sign=False)
        met = "met" if difference.met else "not met"
        value = points_text(difference.score.mean, sign=False)
        tiles.append((value, f"{about}, points a bout (goal {goal}: {met})", colour))
    shares = [meeting.camping_share for meeting in summary.meetings if meeting.bouts]
    if shares:
        tiles.append((percent_text(max(shares)), "of points from camping, at most", ""))
    tiles += [
        (duration_text(summary.seconds), "from start to end", ""),
        (count_text(summary.samples), "samples learned from", ""),
        (count_text(summary.samples_per_s), "samples a second while training", ""),
    ]
    return [
        tag("h1", "Two fencers, trained against each other"),
        tag("p", f"{summary.run} · {summary.started_at} · seed {summary.seed}", class_="soft"),
        tag("p", headline(summary), class_="lead"),
        html.tiles(tiles),
    ]


def _learning(summary: Summary) -> Node:
    curves = [
        StageCurve(
            agent=stage.agent,
            label=f"{stage.agent} learns ({stage.iteration})",
            start=float(stage.samples_before),
            end=float(stage.samples_before + max(1, stage.samples)),
            x=stage.curve.samples,
            mean=stage.curve.mean,
            low=stage.curve.low,
            high=stage.curve.high,
        )
        for stage in summary.stages
    ]
    bouts = sum(stage.complete_bouts for stage in summary.stages)
    words = (
        "The antagonist's mean game score in the bouts that training played, with the 95 % "
        f"interval of the mean ({bouts:,} whole bouts of {summary.bout_seconds:g} s). Whoever "
        "learns pulls the curve its way: the antagonist up, the protagonist down."
    )
    rows = [
        (
            _agent(stage.agent, f"{stage.index + 1}. {stage.agent} {stage.iteration}"),
            stage.opponent,
            f"{stage.updates} of {stage.max_updates}",
            count_text(stage.samples),
            clock_text(stage.seconds),
            {"budget": "budget spent", "converged": "converged"}.get(stage.ended, "running"),
            "-" if stage.first is None else points_text(stage.first.mean),
            "-" if stage.last is None else points_text(stage.last.mean),
        )
        for stage in summary.stages
    ]
    headers = ("stage", "against", "updates", "samples", "time", "ended", "score first", "last")
    return html.section(
        "Learning",
        html.figure(html.svg(learning_curve(curves, "samples both agents learned from")), words),
        html.table(headers, rows, numbers=(2, 3, 4, 6, 7)),
    )


def _evaluation(summary: Summary) -> Node:
    if not summary.meetings:
        return html.section("Evaluation", tag("p", "No evaluation has been played yet."))
    played = {meeting.bouts for meeting in summary.meetings}
    number = f"{min(played)}" if len(played) == 1 else f"{min(played)} to {max(played)}"
    words = (
        f"Antagonist's score a bout, mean and 95 % bootstrap interval over {number} whole bouts "
        "each, by players as they were at the end of each stage, without exploration noise. "
        "Under it: the share of all points given and taken that came from camping."
    )
    rows = [
        (
            difference.text,
            tag("b", points_text(difference.score.mean)),
            interval_text(difference.score),
            points_text(difference.goal, sign=False),
            _verdict(difference),
        )
        for difference in summary.differences
    ]
    headers = ("what training changed", "points a bout", "95 %", "goal", "verdict")
    return html.section(
        "Evaluation",
        _heat_table(summary.meetings, words),
        tag("h3", "What each side gained"),
        html.table(headers, rows, numbers=(1, 2, 3)),
        html.details("Where the points came from", _points_table(summary.meetings)),
    )


def _heat_table(meetings: Sequence[Meeting], words: str) -> Html:
    antagonists, protagonists = players(tuple(meetings))
    by_names = {(m.antagonist, m.protagonist): m for m in meetings}
    scores = [abs(m.score.mean) for m in meetings if m.score is not None]
    most = max(scores, default=1.0) or 1.0
    rows = [
        (
            _agent("antagonist", antagonist),
            [_cell(by_names.get((antagonist, name)), most) for name in protagonists],
        )
        for antagonist in antagonists
    ]
    return html.matrix(words, [f"v {name}" for name in protagonists], rows)


def _cell(meeting: Meeting | None, most: float) -> Html:
    if meeting is None or meeting.score is None:
        return tag("td", "-")
    score = meeting.score
    strength = 0.08 + 0.5 * min(1.0, abs(score.mean) / most)
    colour = f"background: rgba({HEAT[score.mean >= 0]}, {strength:.2f})"
    return tag(
        "td",
        tag("b", points_text(score.mean)),
        tag("span", interval_text(score), class_="soft"),
        tag("br"),
        tag("span", f"camping {percent_text(meeting.camping_share)}", class_="soft"),
        style=colour,
    )


def _points_table(meetings: Sequence[Meeting]) -> Html:
    rows = [
        (
            f"{meeting.antagonist} v {meeting.protagonist}",
            f"{meeting.bouts:,}",
            points_text(meeting.attack_points),
            points_text(meeting.penalty_points),
            points_text(meeting.camping_points),
            percent_text(meeting.camping_share),
            percent_text(meeting.in_target_share),
        )
        for meeting in meetings
    ]
    headers = (
        "pairing", "bouts", "attacks", "penalties", "camping", "camping share", "time in target",
    )  # fmt: skip
    words = "Points a bout by the rule that gave them; time the antagonist's bat was in the target."
    return html.table(headers, rows, numbers=range(1, 7), caption=words)


def _pictures(pictures: Sequence[Picture]) -> Node:
    if not pictures:
        return None
    figures = [
        html.figure(
            html.svg(picture.svg) if picture.svg else html.png(picture.png, picture.caption),
            picture.caption,
        )
        for picture in pictures
    ]
    words = "One bout between the last two policies, played again for this page."
    return html.section(
        "The trained pair at play", tag("p", words), tag("div", figures, class_="pictures")
    )


def _health(summary: Summary, panels: Sequence[Panel]) -> Node:
    if not panels or not any(panel.lines for panel in panels):
        return html.section("Training health", tag("p", "No update has been made yet."))
    legend = [
        "One point for each update; ",
        _agent("antagonist", "orange: antagonist"),
        ", ",
        _agent("protagonist", "blue: protagonist"),
        ".",
    ]
    rows = [
        (
            _agent(stage.agent, f"{stage.index + 1}. {stage.agent} {stage.iteration}"),
            f"{stage.approx_kl:.4f}",
            f"{stage.clip_fraction:.3f}",
            f"{stage.explained_variance:.2f}",
            f"{stage.policy_lag:.2f}",
            count_text(stage.samples / stage.seconds if stage.seconds > 0 else 0.0),
        )
        for stage in summary.stages
    ]
    headers = ("stage", "KL", "clip fraction", "explained variance", "policy lag", "samples/s")
    drawing = html.svg(training_panels(panels, "minutes since the start"))
    return html.section(
        "Training health",
        html.figure(drawing, legend),
        html.table(headers, rows, numbers=range(1, 6), caption="Means over each stage's updates."),
    )


def _happened(summary: Summary) -> Node:
    ledger = "No rollout was learned from twice."
    if summary.repeated_rollouts:
        ledger = f"{summary.repeated_rollouts} rollouts were learned from twice: report this."
    lapsed = f"{summary.leases_lapsed} leases lapsed because an actor fell silent. "
    opening = lapsed if summary.leases_lapsed else ""
    if not summary.incidents:
        words = "Nothing out of the ordinary: no process was restarted, no rollout refused. "
        return html.section("What happened during the run", tag("p", words, opening, ledger))
    counts = ", ".join(
        f"{number} x {what.replace('_', ' ')}" for what, number in summary.incident_counts.items()
    )
    rows = [
        (clock_text(i.seconds), i.source, i.what.replace("_", " "), i.detail)
        for i in summary.incidents[:MOST_INCIDENTS]
    ]
    left = len(summary.incidents) - len(rows)
    caption = f"{left:,} more are in the ledger." if left > 0 else None
    table = html.table(("when", "who", "what", "detail"), rows, caption=caption)
    return html.section(
        "What happened during the run", tag("p", f"{counts}. {opening}{ledger}"), table
    )


def _again(summary: Summary, extras: Extras) -> Node:
    origin = summary.origin
    packages = [(name, version) for name, version in sorted(origin.packages.items())]
    first = summary.first_update_seconds
    facts: list[tuple[Node, Node]] = [
        ("seed", str(summary.seed)),
        ("mode", "serial, one process" if summary.serial else "processes on the bus"),
        ("commit", tag("code", origin.commit or "unknown")),
        ("simulator model", tag("code", summary.model or "unknown")),
        ("Python", origin.python),
        ("machine", origin.machine),
        ("first update after", "-" if first < 0 else duration_text(first)),
        ("evaluation took", duration_text(summary.evaluation_seconds)),
    ]
    return html.section(
        "Do it again",
        tag("pre", origin.command),
        html.table(("", ""), facts),
        html.details("Files of this run", html.table(("file", "what it is"), extras.files)),
        html.details("Package versions", html.table(("package", "version"), packages)),
        html.details("Configuration", tag("pre", extras.config)),
    )


def _verdict(difference: Difference) -> Html:
    if difference.certain:
        return tag("span", "met", class_="good")
    if difference.met:
        return tag("span", "met on average, the interval reaches below", class_="good")
    return tag("span", "not met", class_="bad")


def _agent(agent: str, text: str) -> Html:
    return tag("span", text, class_=agent)
