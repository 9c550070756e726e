"""The HTML page of the reproduction report."""

from collections.abc import Iterable, Sequence

from services.jobs.report.summary import Summary
from services.jobs.report.words import count_text, duration_text, percent_text, points_text
from services.jobs.reproduction.claims import share_text, span_text
from services.jobs.reproduction.parts import (
    Cell,
    Claim,
    Missing,
    Reproduction,
    Score,
    Styles,
    Tournament,
)
from shared.telemetry import html
from shared.telemetry.html import Html, Node, tag
from shared.telemetry.reproduction_figures import (
    DrawPanel,
    Line,
    RoundPanel,
    both_phases,
    drawn_opponents,
)

HEAT = {True: "217, 83, 44", False: "53, 118, 196"}
"""Red, green, blue of a score the antagonist, or the protagonist, can be content with."""
VERDICTS = {True: ("yes", "good"), False: ("no", "bad"), None: ("not known yet", "soft")}
FIFTHS = ("oldest fifth", "second", "third", "fourth", "newest fifth")


def page(found: Reproduction, summary: Summary, config: str) -> str:
    """Return the whole page."""
    sections: list[Node] = [
        _head(found, summary),
        _claims(found),
        _learning(found, summary),
        _draws(found),
        _part("Tournament", found.missing, "tournament", _tournament(found.tournament)),
        _part("Styles and selection", found.missing, "styles", _styles(found.styles)),
        _part("Exploitability", found.missing, "exploitability", _exploited(found)),
        _time(found),
        _again(found, summary, config),
        tag("footer", f"Riposte {summary.origin.packages.get('riposte', '')}, run {found.run}."),
    ]
    return html.page(f"Riposte: reproduction, {found.run}", *sections)


def _head(found: Reproduction, summary: Summary) -> Node:
    def counted(source: str) -> tuple[int, int, int]:
        own = [claim.holds for claim in found.claims if claim.source == source]
        return own.count(True), own.count(False), own.count(None)

    tiles: list[tuple[Node, Node, str]] = []
    for source, about in (("paper", "lines of the paper match"), ("goal", "goals are met")):
        yes, no, unknown = counted(source)
        more = f", {unknown} not known yet" if unknown else ""
        tiles.append((f"{yes} of {yes + no + unknown}", f"{about}{more}", "" if no else "good"))
    tiles += [
        (f"{found.rounds} of {found.rounds_planned}", "rounds, a pair of fencers from each", ""),
        (count_text(summary.samples), "samples learned from", ""),
        (duration_text(found.seconds), "all stages together", ""),
    ]
    words = (
        f"Phase one of {found.iterations} iterations, then {found.rounds} rounds of "
        f"{found.round_iterations} small updates of each side against opponents drawn from their "
        f"history ({found.sampler}), after Yang et al. 2021."
    )
    return [
        tag("h1", "The paper's pipeline, reproduced"),
        tag("p", f"{found.run} · {summary.started_at} · seed {found.seed}", class_="soft"),
        tag("p", words, class_="lead"),
        html.tiles(tiles),
    ]


def _claims(found: Reproduction) -> Node:
    def rows(source: str) -> Iterable[Sequence[Node]]:
        return (_claim(claim) for claim in found.claims if claim.source == source)

    return html.section(
        "What matches the paper and what does not",
        html.table(("", "the paper", "found", "matches"), rows("paper")),
        tag("h3", "Goals of this reproduction"),
        html.table(("", "goal", "found", "met"), rows("goal")),
    )


def _claim(claim: Claim) -> Sequence[Node]:
    word, colour = VERDICTS[claim.holds]
    return tag("b", claim.about), claim.expected, claim.found, tag("span", word, class_=colour)


def _learning(found: Reproduction, summary: Summary) -> Node:
    phase_one = [Line(s.agent, s.curve.samples, s.curve.mean) for s in summary.stages]
    ends = [float(s.samples_before + s.samples) for s in summary.stages]
    panels: list[RoundPanel] = []
    for played in summary.rounds:
        start = played.turns[0].samples_before
        lines: list[Line] = []
        for agent in ("antagonist", "protagonist"):
            own = [t for t in played.turns if t.agent == agent and t.score is not None]
            x = [float(t.samples_before - start + t.samples / 2) for t in own]
            lines.append(Line(agent, x, [t.score or 0.0 for t in own]))
        panels.append(RoundPanel(f"round {played.round}", lines))
    words = [
        "The antagonist's mean game score over both phases, one plot for each round: phase one, "
        "the same for all, then the round. ",
        tag("span", "Orange: the antagonist learns", class_="antagonist"),
        ", ",
        tag("span", "blue: the protagonist learns", class_="protagonist"),
        ". In phase one a point is a mean over whole bouts. A stage of a round is shorter than a "
        "bout: there a point is the mean reward of a step times the steps of a bout.",
    ]
    rows = [(s.name, points_text(s.swing), points_text(s.level)) for s in found.stretches]
    about = [claim for claim in found.claims if claim.about in SHAPE]
    verdicts = [
        tag(
            "li", tag("b", claim.about), f": {claim.expected}. Found: {claim.found}. ", _said(claim)
        )
        for claim in about
    ]
    caption = (
        "Swing: score where the antagonist had just learned minus where the protagonist had; in a "
        "round over the second half of its iterations. Level: the mean of the two."
    )
    return html.section(
        "Learning over both phases",
        html.figure(html.svg(both_phases(phase_one, ends, panels)), words),
        tag("ul", verdicts),
        html.table(("", "swing, points a bout", "level"), rows, numbers=(1, 2), caption=caption),
    )


SHAPE = ("phase one, iteration 1", "end of phase one", "phase two")


def _said(claim: Claim) -> Html:
    words = {True: "This matches.", False: "This does not match.", None: "Not known yet."}
    return tag("span", words[claim.holds], class_=VERDICTS[claim.holds][1])


def _draws(found: Reproduction) -> Node:
    rounds = [d for d in found.draws if d.round]
    rows = [
        (
            f"round {d.round}" if d.round else "all rounds",
            d.draws,
            d.distinct,
            f"{d.warm_starts} ({d.warm_starts_expected:.1f})",
            *(
                f"{seen} ({due:.1f})"
                for seen, due in zip(d.by_age[:5], d.by_age_expected[:5], strict=True)
            ),
            "-" if d.p is None else f"{d.p:.3f}",
            f"{d.replayed}",
        )
        for d in found.draws
        if len(d.by_age) > len(FIFTHS)
    ]
    headers = ("", "draws", "versions", "warm start", *FIFTHS, "p", "replayed")
    panels = [DrawPanel(f"round {d.round}", d.points) for d in rounds]
    words = [
        "Which version of the other side's history was drawn in each iteration, 0 being the warm "
        "start; the dashed line is the newest when the antagonist's turn began. ",
        tag("span", "Orange: drawn for the antagonist", class_="antagonist"),
        ", ",
        tag("span", "blue: for the protagonist", class_="protagonist"),
        ".",
    ]
    caption = (
        f"Draws, in brackets what the sampler ({found.sampler}) makes expect, by fifth of the "
        "history as it was then. p: how often the same sampler, simulated, fits as badly or worse "
        "(chi-square over the fifths). Replayed: draws that come out alike from the ledger alone."
    )
    return html.section(
        "History and opponents drawn",
        html.figure(html.svg(drawn_opponents(panels)), words),
        html.table(headers, rows, numbers=range(1, len(headers)), caption=caption),
    )


def _tournament(tournament: Tournament | None) -> Node:
    if tournament is None:
        return None
    words = (
        "The antagonist's score a bout, mean and 95 % bootstrap interval. Under it: the share of "
        "all points given and taken that came from camping."
    )
    return [
        tag(
            "p",
            f"{tournament.bouts:,} bouts; {percent_text(tournament.camping_share)} of all points "
            "given and taken came from camping. ",
            _more("tournament/tournament.html"),
        ),
        heat(tournament, words),
        tag("h3", "Against scripted and simulated people"),
        _held(tournament),
        html.details("Ratings", _ratings(tournament)),
    ]


def heat(tournament: Tournament, words: str) -> Html:
    """Return the payoff as a matrix."""
    cells = {(cell.antagonist, cell.protagonist): cell for cell in tournament.cells}
    most = max((abs(cell.score.mean) for cell in tournament.cells), default=1.0) or 1.0
    rows = [
        (
            tag("span", one, class_="antagonist"),
            [_cell(cells.get((one, two)), most) for two in tournament.protagonists],
        )
        for one in tournament.antagonists
    ]
    return html.matrix(words, [f"v {name}" for name in tournament.protagonists], rows)


def _cell(cell: Cell | None, most: float) -> Html:
    if cell is None:
        return tag("td", "-")
    strength = 0.08 + 0.5 * min(1.0, abs(cell.score.mean) / most)
    return tag(
        "td",
        tag("b", points_text(cell.score.mean)),
        tag("span", span_text(cell.score), class_="soft"),
        tag("br"),
        tag("span", f"camping {percent_text(cell.camping_share)}", class_="soft"),
        style=f"background: rgba({HEAT[cell.score.mean >= 0]}, {strength:.2f})",
        title=f"{cell.antagonist} v {cell.protagonist}: {span_text(cell.score)}",
    )


def _held(tournament: Tournament) -> Node:
    if not tournament.scripted:
        return tag("p", "No scripted antagonist was in the tournament.")
    rows = [
        (
            one.protagonist,
            points_text(one.score.mean),
            span_text(one.score),
            *_taken(one.below_static),
            *_taken(one.below_heuristic),
            *_taken(one.below_retreating),
            points_text(one.camping_points, sign=False),
        )
        for one in tournament.held
    ]
    headers = (
        "protagonist", "score", "95 %", "below static", "95 %", "below heuristic", "95 %",
        "below retreating", "95 %", "camping",
    )  # fmt: skip
    caption = (
        f"Mean score a bout of {', '.join(tournament.scripted)}, each counted alike; the lower, "
        "the better for the protagonist. Baselines first. Camping: points a bout paid for the "
        "protagonist's own."
    )
    return html.table(headers, rows, numbers=range(1, 10), caption=caption)


def _taken(score: Score | None) -> tuple[Node, Node]:
    if score is None:
        return "-", "-"
    colour = "good" if score.low > 0 else "bad" if score.high < 0 else None
    return tag("span", points_text(score.mean), class_=colour), span_text(score)


def _ratings(tournament: Tournament) -> Html:
    rows = [
        (
            tag("span", rated.player, class_=rated.agent),
            f"{rated.elo:+.0f}",
            f"{rated.low:+.0f} to {rated.high:+.0f}",
            percent_text(rated.win_share),
        )
        for rated in tournament.ratings
    ]
    caption = "Elo points from the mean of the own side (Bradley-Terry); a bout above 0 points is "
    return html.table(
        ("player", "Elo", "95 %", "bouts won"), rows, numbers=(1, 2, 3),
        caption=caption + "won by the antagonist.",
    )  # fmt: skip


def _styles(styles: Styles | None) -> Node:
    if styles is None:
        return None
    rows: list[tuple[Node, Node]] = [
        ("policies compared", str(styles.policies)),
        ("information in three components", f"{styles.information:.2%}"),
        ("the same of single bouts", f"{styles.information_of_bouts:.2%}"),
        ("selected", ", ".join(styles.selected)),
        (
            "bouts given to the right one of the three",
            f"{share_text(styles.accuracy)}, chance {styles.chance:.0%}",
        ),
        (
            "the same against opponents held out",
            "-" if styles.accuracy_unseen is None else share_text(styles.accuracy_unseen),
        ),
        (
            "mean distance of two policies",
            f"{_number(styles.distance)} standard deviations from bout to bout",
        ),
        ("effective number of styles", f"{_number(styles.effective_styles)} of {styles.policies}"),
    ]
    why = tag("p", styles.why_not) if styles.why_not else None
    return [html.table(("", ""), rows), why, tag("p", _more("styles/styles.html"))]


def _more(path: str) -> Node:
    return ["More in ", tag("a", path, href=path), "."]


def _number(score: Score) -> str:
    return f"{score.mean:.2f} ({score.low:.2f} to {score.high:.2f})"


def _exploited(found: Reproduction) -> Node:
    if not found.exploitability:
        return None
    rows = [
        (
            one.name,
            points_text(one.score.mean),
            span_text(one.score),
            one.score.count,
            count_text(one.samples),
        )
        for one in found.exploitability
    ]
    words = (
        "Mean score a bout of fresh antagonists that learned against the frozen protagonist alone. "
        "The antagonist maximises it: the higher, the more exploitable the protagonist."
    )
    headers = ("protagonist of", "score a bout", "range over seeds", "seeds", "samples each")
    return html.table(headers, rows, numbers=range(1, 5), caption=words)


def _time(found: Reproduction) -> Node:
    rows = [(stage.name, duration_text(stage.seconds)) for stage in found.stages]
    rows.append(("together", duration_text(found.seconds)))
    return html.section("Time of each stage", html.table(("stage", "time"), rows, numbers=(1,)))


def _again(found: Reproduction, summary: Summary, config: str) -> Node:
    origin = summary.origin
    facts: list[tuple[Node, Node]] = [
        ("seed", str(found.seed)),
        ("mode", "serial, one process" if summary.serial else "processes on the bus"),
        ("commit", tag("code", origin.commit or "unknown")),
        ("simulator model", tag("code", summary.model or "unknown")),
        ("Python", origin.python),
        ("machine", origin.machine),
    ]
    return html.section(
        "Do it again",
        tag("pre", origin.command),
        html.table(("", ""), facts),
        tag("p", "Training health and incidents are in report.html, all numbers of this page in "
            "reproduction.json."),
        html.details(
            "Package versions", html.table(("package", "version"), sorted(origin.packages.items()))
        ),
        html.details("Configuration", tag("pre", config)),
    )  # fmt: skip


def _part(title: str, missing: Sequence[Missing], name: str, content: Node) -> Node:
    """Return a section, or how to make it."""
    if content is not None:
        return html.section(title, content)
    lacking = next((one for one in missing if one.part == name), None)
    if lacking is None:
        return html.section(title, tag("p", "Nothing here."))
    reason = f"Not there: {lacking.reason}" if lacking.reason else "Not played yet:"
    return html.section(title, tag("p", f"{reason} ", tag("code", lacking.command)))
