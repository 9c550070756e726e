"""The page of a tournament: heat map, ratings, equilibrium, where the points came from."""

from services.jobs.report.words import points_text
from services.jobs.tournament.results import Player, Standings, Summary
from shared.styles.bouts import BoutTable
from shared.styles.ratings import DRAWS, NASH_DRAWS, RIDGE, Estimate
from shared.telemetry import html
from shared.telemetry.html import Html, Node, tag
from shared.telemetry.tournament_figures import Strength, heat_map, strengths

LISTED_WEIGHT = 0.005
"""A player with less of the Nash mixture counts as outside it."""


def tournament_page(standings: Standings, summary: Summary, config: str) -> str:
    """Return the whole page.

    Args:
        standings: payoff and ratings.
        summary: their numbers.
        config: the resolved configuration, TOML.
    """
    return html.page(
        f"Riposte: tournament of {summary.run}",
        _head(standings, summary),
        _payoff(standings),
        _ratings(summary),
        _equilibrium(standings.table, summary),
        _points(standings, summary),
        _again(summary, config),
    )


def estimate_text(estimate: Estimate, *, sign: bool = True) -> str:
    """Return a number and its interval: ``+120 (+80 to +161)``."""
    value, low, high = (
        points_text(number, sign=sign) for number in (estimate.value, estimate.low, estimate.high)
    )
    return f"{value} ({low} to {high})"


def _head(standings: Standings, summary: Summary) -> Node:
    payoff = standings.payoff
    best, guard = summary.antagonists[0], summary.protagonists[0]
    tiles: list[tuple[Node, Node, str]] = [
        (f"{summary.bouts:,}", f"bouts of {summary.bouts_planned:,}", ""),
        (f"{len(payoff.antagonists)} x {len(payoff.protagonists)}", "players met", ""),
        (best.label, "highest rated antagonist", "antagonist"),
        (guard.label, "highest rated protagonist", "protagonist"),
    ]
    if summary.value is not None:
        value = points_text(summary.value.value)
        tiles.append((value, "points a bout between the two Nash mixtures", ""))
    return [
        tag("h1", "Everybody against everybody"),
        tag("p", f"{summary.run} · seed {summary.seed}", class_="soft"),
        html.tiles(tiles),
    ]


def _payoff(standings: Standings) -> Node:
    payoff, label = standings.payoff, standings.table.label
    drawing = heat_map(
        [label(ref) for ref in payoff.antagonists],
        [label(ref) for ref in payoff.protagonists],
        payoff.mean,
        payoff.low,
        payoff.high,
        payoff.camping_share,
    )
    words = (
        "Mean score a bout with its 95 % bootstrap interval: what the antagonist of the row gets "
        "against the protagonist of the column; and the share of all points given and taken that "
        "came from camping, where there is any."
    )
    return html.section("Payoff", html.figure(html.svg(drawing), words))


def _ratings(summary: Summary) -> Node:
    def pool(players: tuple[Player, ...]) -> list[Strength]:
        return [Strength(p.label, p.elo.value, p.elo.low, p.elo.high) for p in players]

    words = (
        "Bradley-Terry on who won each bout; the antagonist wins with a score above 0. Each "
        "pool is on its own scale, 0 is its mean; 400 points are odds of ten to one. A mean "
        f"antagonist is {estimate_text(summary.antagonist_advantage)} points stronger than a "
        f"mean protagonist. Ridge {RIDGE:g}, half a win and half a loss added to each pairing, "
        f"intervals from {DRAWS:,} draws of the win shares."
    )
    drawing = strengths(pool(summary.antagonists), pool(summary.protagonists))
    return html.section("Ratings", html.figure(html.svg(drawing), words))


def _equilibrium(table: BoutTable, summary: Summary) -> Node:
    if summary.value is None:
        return html.section("Nash averaging", tag("p", "Some pairings have no bouts yet."))
    words = (
        "The mean scores as a zero-sum game between the pools (Balduzzi et al. 2018): the "
        "mixtures that no player of the other side can exploit, worth "
        f"{estimate_text(summary.value)} points a bout. Who has no weight is dominated. "
        "Exploitability: the points a bout that the best response of the other pool takes from "
        f"a player, measured from that value. Intervals from {NASH_DRAWS} resampled matrices."
    )
    parts: list[Node] = [tag("p", words)]
    for agent, pool in (("antagonist", summary.antagonists), ("protagonist", summary.protagonists)):
        rows = [_nash_row(table, player) for player in pool]
        headers = (f"{agent}s", "Elo", "weight", "95 %", "exploitability", "95 %", "by")
        parts.append(html.table(headers, rows, numbers=(1, 2, 3, 4, 5)))
    return html.section("Nash averaging", *parts)


def _nash_row(table: BoutTable, player: Player) -> tuple[Node, ...]:
    weight, exploited = player.nash_weight, player.exploitability
    assert weight is not None  # the caller has looked
    assert exploited is not None
    assert player.best_response is not None
    share = f"{weight.value:.2f}" if weight.value >= LISTED_WEIGHT else "-"
    return (
        player.label,
        points_text(player.elo.value),
        tag("b", share),
        f"{weight.low:.2f} to {weight.high:.2f}",
        tag("b", points_text(exploited.value, sign=False)),
        f"{points_text(exploited.low, sign=False)} to {points_text(exploited.high, sign=False)}",
        table.label(player.best_response),
    )


def _points(standings: Standings, summary: Summary) -> Html:
    label = standings.table.label
    rows = [
        (
            f"{label(cell.antagonist)} v {label(cell.protagonist)}",
            f"{cell.wins} of {cell.bouts}",
            points_text(cell.mean),
            points_text(cell.attack_points),
            points_text(cell.penalty_points),
            points_text(cell.camping_points),
            f"{cell.camping_share:.1%}",
            f"{cell.in_target_share:.1%}",
        )
        for cell in summary.pairings
    ]
    headers = (
        "pairing", "won by antagonist", "score", "attacks", "penalties", "camping",
        "camping share", "time in target",
    )  # fmt: skip
    words = "Points a bout by the rule that gave them; time the antagonist's bat was in the target."
    table = html.table(headers, rows, numbers=range(1, 8), caption=words)
    return html.section("Where the points came from", html.details("Every pairing", table))


def _again(summary: Summary, config: str) -> Html:
    facts: list[tuple[Node, Node]] = [
        ("seed", str(summary.seed)),
        ("commit", tag("code", summary.commit or "unknown")),
        ("simulator model", tag("code", summary.model or "unknown")),
        ("world steps a second and actor", f"{summary.steps_per_s:,.0f}"),
    ]
    players = [(p.label, tag("code", p.player)) for p in summary.antagonists + summary.protagonists]
    return html.section(
        "Do it again",
        tag("p", "The same seed, players and number of bouts play the same bouts, on any number of "
            "actors."),
        html.table(("", ""), facts),
        html.details("Players", html.table(("name", "reference"), players)),
        html.details("Configuration", tag("pre", config)),
    )  # fmt: skip
