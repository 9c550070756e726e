"""Parts of the report: what else was considered, what is left, what to do next, how it was made."""

from collections.abc import Sequence

from services.jobs.identify import pictures, words
from services.jobs.identify.pictures import Picture
from shared.identification.conclusion.evidence import Evidence
from shared.identification.verdict import NAMED_SHARE, Limit, Scored, Tie, Verdict
from shared.telemetry import html
from shared.telemetry.html import Html, Node, tag

MOST_REASONS = 6
"""Candidates whose reasons are beside the picture; the table has all."""


def panels(found: Sequence[Picture]) -> Html:
    """Return pictures side by side where there is room, each with what it shows."""
    shown = [html.figure(html.svg(one.svg), one.caption) for one in found]
    return tag("div", shown, class_="panels")


def ties(verdict: Verdict) -> Html | None:
    """Return the causes that the data do not tell apart, and what would."""
    if not verdict.ties:
        return None
    return html.section("One of these", [_tie(tie) for tie in verdict.ties])


def _tie(tie: Tie) -> Node:
    rows = [
        (
            tag("b", cause.title),
            words.where_text(cause.where),
            words.size_text(cause),
            cause.signature,
        )
        for cause in tie.causes
    ]
    about = (
        f"Their signatures are alike to {words.number_text(tie.alike)} of 1 in these recordings."
    )
    return [
        html.table(("either", "where", "then (95 %)", "how it shows"), rows, caption=about),
        tag("p", tag("b", "What would tell: "), tie.record),
    ]


def record_next(verdict: Verdict) -> Html | None:
    """Return what to record next."""
    if not verdict.record_next:
        return None
    return html.section(
        "What to record next", tag("ol", [tag("li", sentence) for sentence in verdict.record_next])
    )


def candidates(verdict: Verdict) -> Html:
    """Return every candidate with its scores, and why it was not named."""
    picture = pictures.candidates(verdict)
    ruled = [(tag("code", effect), why) for effect, why in verdict.ruled_out.items()]
    headers = ("candidate", "screen", "held-out gain (95 %)", "value", "why not")
    about = (
        "Screen: share of the training residual that a candidate takes off once the base's share "
        "is taken out. Gain: held-out loss that it takes off when base and candidate are fitted "
        "anew; only the best of the screen are."
    )
    return html.section(
        "What else was considered",
        tag("div", panels([picture]), _reasons(verdict), class_="beside")
        if picture is not None
        else None,
        html.details(
            f"All {len(verdict.candidates)} candidates",
            html.table(headers, [_row(verdict, each) for each in verdict.candidates],
                       numbers=(1, 2, 3), caption=about),
        ),
        html.details(
            f"{len(ruled)} effects that could not be looked for",
            html.table(("effect", "why"), ruled),
        ) if ruled else None,
    )  # fmt: skip


def limits(verdict: Verdict) -> Html | None:
    """Return from which size on the effects that were not named would have been."""
    if not verdict.limits:
        return None
    effects: dict[str, list[Limit]] = {}
    for each in verdict.limits:
        effects.setdefault(each.effect, []).append(each)
    headers = ("effect", "where it shows most", "where it shows least", "nowhere to be seen at")
    rows = [_limits(each) for each in effects.values()]
    if not any(each.size is None for each in verdict.limits):
        headers, rows = headers[:-1], [row[:-1] for row in rows]
    about = (
        f"Sizes that would take {NAMED_SHARE:.0%} off what is left, which is named nine times of "
        "ten; smaller ones often, too. What the base model can make up for does not count."
    )
    table = html.table(headers, rows, caption=about)
    return html.section(
        "What else would have been named" if verdict.causes else "What would have been named",
        table
        if verdict.verdict == "none"
        else html.details(f"From which size on, {len(effects)} effects", table),
    )


def _limits(alike: Sequence[Limit]) -> tuple[Node, ...]:
    """Return a row of one effect: where it would show most and least, and where not."""
    seen = sorted(
        (each for each in alike if each.size is not None), key=lambda each: each.size or 0.0
    )
    unseen = [words.where_text(each.where) for each in alike if each.size is None]
    return (
        tag("b", alike[0].title),
        _limit(seen[0]) if seen else "at no size",
        _limit(seen[-1]) if len(seen) > 1 else "",
        ", ".join(unseen) if seen else "",
    )


def _limit(limit: Limit) -> str:
    where = f" ({limit.where})" if limit.where else ""
    return f"{words.limit_text(limit)}{where}"


def _reasons(verdict: Verdict) -> Node:
    named = {(cause.effect, cause.where) for cause in verdict.causes}
    others = [each for each in verdict.candidates if (each.effect, each.where) not in named]
    rows = [
        (f"{each.effect} {each.where}".strip(), each.why_not)
        for each in others[:MOST_REASONS]
        if each.why_not
    ]
    return html.table(("not named", "why not"), rows) if rows else None


def _row(verdict: Verdict, each: Scored) -> tuple[Node, ...]:
    place = (each.effect, each.where)
    is_named = any((cause.effect, cause.where) == place for cause in verdict.causes)
    gain = "-" if each.gain is None else words.number_text(each.gain)
    if each.gain is not None and each.gain_interval is not None:
        low, high = each.gain_interval.low, each.gain_interval.high
        gain += f" ({words.number_text(low, 2)} to {words.number_text(high, 2)})"
    return (
        f"{each.effect} {each.where}".strip(),
        words.share_text(each.screen),
        gain,
        "-" if each.value is None else words.quantity_text(each.value, each.unit),
        tag("b", "named", class_="good") if is_named else each.why_not,
    )


def unexplained(verdict: Verdict, evidence: Evidence) -> Html:
    """Return where something is left that nothing accounts for."""
    picture = pictures.unexplained(verdict, evidence)
    rows = [
        (
            tag("b", words.unexplained_mark(number)),
            left.where,
            left.trajectory,
            f"{words.moment_text(left.begin)} to {words.moment_text(left.end)}",
            words.when_text(left),
            words.quantity_text(left.size, left.unit),
            words.number_text(left.times_noise, 2),
        )
        for number, left in enumerate(verdict.unexplained)
    ]
    headers = ("", "where", "trajectory", "time (s)", "when", "size", "times noise")
    nothing = tag("p", "Nothing that stands out from the noise.")
    return html.section(
        "What stays unexplained",
        html.table(headers, rows, numbers=(5, 6)) if rows else nothing,
        panels([picture]),
    )


def caveats(verdict: Verdict) -> Html | None:
    """Return what limits how far this can be believed."""
    if not verdict.caveats:
        return None
    return html.section("Caveats", tag("ul", [tag("li", caveat) for caveat in verdict.caveats]))


def again(verdict: Verdict, command: str) -> Html:
    """Return how it was made and where the time went."""
    facts: list[tuple[Node, Node]] = [
        ("data set (SHA-256)", tag("code", verdict.dataset)),
        ("model", tag("code", verdict.model)),
        ("seed", str(verdict.seed)),
        ("version", f"{verdict.version} {verdict.commit}".strip()),
        ("CPU time", f"{words.number_text(verdict.cpu_s)} s"),
    ]
    times = [(step, words.number_text(seconds)) for step, seconds in verdict.seconds.items()]
    return html.section(
        "Do it again",
        tag("pre", command),
        html.table(("", ""), facts),
        html.details("CPU seconds by step", html.table(("step", "s"), times, numbers=(1,))),
    )
