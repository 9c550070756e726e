"""The standings of a tournament in words, for a terminal."""

from collections.abc import Sequence

from services.jobs.report.words import points_text
from services.jobs.tournament.results import Standings
from shared.styles.ratings import Estimate, NashPlayer, Rating


def standings_text(standings: Standings) -> str:
    """Return both pools, strongest first, with ratings and equilibrium."""
    ratings, nash = standings.ratings, standings.nash
    places = {
        place.player: place
        for place in (() if nash is None else (*nash.antagonists, *nash.protagonists))
    }
    lines: list[str] = []
    for agent, pool in (
        ("antagonists", ratings.antagonists),
        ("protagonists", ratings.protagonists),
    ):
        head = (agent, "Elo", "95 %", "won", "Nash", "exploitable by", "95 %")
        rows = [_row(standings, rating, places.get(rating.player)) for rating in pool]
        lines += [*aligned([head, *rows]), ""]
    advantage = _interval(ratings.antagonist_advantage)
    lines.append(f"A mean antagonist is {advantage} Elo points stronger than a mean protagonist.")
    if nash is not None:
        lines.append(f"Between the two Nash mixtures a bout is worth {_interval(nash.value)}.")
    else:
        lines.append("Some pairings have no bouts yet: no equilibrium.")
    return "\n".join(lines)


def _row(standings: Standings, rating: Rating, place: NashPlayer | None) -> tuple[str, ...]:
    row = (
        standings.table.label(rating.player),
        points_text(rating.elo.value),
        f"{points_text(rating.elo.low)} to {points_text(rating.elo.high)}",
        f"{rating.win_share:.0%} of {rating.bouts:,}",
    )
    if place is None:
        return (*row, "-", "-", "-")
    exploited = place.exploitability
    reach = (points_text(number, sign=False) for number in (exploited.low, exploited.high))
    return (
        *row,
        f"{place.weight.value:.2f}",
        points_text(exploited.value, sign=False),
        " to ".join(reach),
    )


def _interval(estimate: Estimate) -> str:
    low, high = points_text(estimate.low), points_text(estimate.high)
    return f"{points_text(estimate.value)} (95 %: {low} to {high})"


def aligned(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return rows of a table, the first column flush left and the others flush right."""
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return [
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
