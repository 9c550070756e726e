"""What the paper says, what was found in a run, and whether the two agree; computed, not written.

Yang et al. 2021, section 3.1 and appendix; the goals are those set for this reproduction.
"""

from collections.abc import Sequence

from services.jobs.report.summary import StageSummary, Summary
from services.jobs.report.words import duration_text, percent_text, points_text
from services.jobs.reproduction.parts import Claim, Held, Reproduction, Score, Tournament
from services.league.history import RunState

ITERATIONS = 2
ROUND_ITERATIONS = 35
ROUNDS = 6
BOUTS = 600
"""Of each protagonist: 100 against each of six antagonists."""
SELECTED = 3
COMPONENTS = 3
INFORMATION = 0.98
ACCURACY = 0.9
SIGNIFICANCE = 0.01
"""A chance as small as this that the sampler made these draws is called a misfit."""
MINUTES = 90
HEURISTIC = "heuristic"
CAMPING = 0.1
"""Share of points from camping above which the game played is another one."""


def claims_of(found: Reproduction, summary: Summary, state: RunState) -> tuple[Claim, ...]:
    """Return the table of what matches and what does not."""
    return (*_counts(found), *_training(found, summary, state), *_results(found), *_goals(found))


def span_text(score: Score) -> str:
    """Return the 95 % interval of a score."""
    return f"{points_text(score.low)} to {points_text(score.high)}"


def share_text(score: Score) -> str:
    """Return a share in percent with its 95 % interval."""
    return f"{score.mean:.1%} ({score.low:.1%} to {score.high:.1%})"


def _counts(found: Reproduction) -> list[Claim]:
    tournament = found.tournament
    updates = found.round_updates
    return [
        _paper(
            "iterations of phase one", f"N_iter = {ITERATIONS}", f"{found.iterations}",
            found.iterations == ITERATIONS,
        ),
        _paper(
            "small updates in a round", f"{ROUND_ITERATIONS}",
            f"{found.round_iterations}, each {updates[0]} PPO updates of the antagonist and "
            f"{updates[1]} of the protagonist",
            found.round_iterations == ROUND_ITERATIONS,
        ),
        _paper(
            "rounds, a pair from each", f"{ROUNDS} rounds, {ROUNDS} pairs",
            f"{found.rounds} of {found.rounds_planned} rounds played out", found.rounds == ROUNDS,
        ),
        _paper(
            "bouts of each protagonist against the library's antagonists", f"{BOUTS}",
            _unknown(tournament is not None, f"{tournament.least_bouts if tournament else 0:,}"),
            None if tournament is None else tournament.least_bouts >= BOUTS,
        ),
    ]  # fmt: skip


def _training(found: Reproduction, summary: Summary, state: RunState) -> list[Claim]:
    claims: list[Claim] = []
    rewards = {
        (r.stage.score_weight, r.stage.shaping_weight) for r in state.stages if r.stage.round
    }
    plain = all(shaping == 0.0 for _, shaping in rewards)
    claims.append(
        _paper(
            "reward of phase two", "the game score alone",
            "the game score alone" if plain else "with a continuous part", plain,
        )
    )  # fmt: skip
    draws = found.draws[0]
    fit = "no draw had a choice" if draws.p is None else f"chi-square p = {draws.p:.3f}"
    is_fair = None if draws.p is None else draws.p >= SIGNIFICANCE
    is_uniform = found.sampler == "uniform"
    claims.append(
        _paper(
            "opponents of phase two", "drawn at random from earlier versions",
            f"{found.sampler} over {draws.draws} draws, {fit}; {draws.replayed} of {draws.draws} "
            "drawn again alike from the ledger",
            is_fair if is_uniform else False,
        )
    )  # fmt: skip
    claims += _shape(found, summary.stages)
    return claims


def _shape(found: Reproduction, stages: Sequence[StageSummary]) -> list[Claim]:
    """Return the claims about the learning figure."""
    first = [s for s in stages if s.iteration == 1 and s.first is not None and s.last is not None]
    moves = [(s.agent, s.first.mean, s.last.mean) for s in first if s.first and s.last]
    told = "; ".join(
        f"{points_text(begin)} to {points_text(end)} while the {agent} learned"
        for agent, begin, end in moves
    )
    both = len(moves) == 2
    follows = all((end > begin) == (agent == "antagonist") for agent, begin, end in moves)
    claims = [
        _paper(
            "phase one, iteration 1", "the score is biased to whoever is learning",
            _unknown(both, told), follows if both else None,
        )
    ]  # fmt: skip
    phase_one = [s for s in found.stretches if s.name.startswith("phase one")]
    if not phase_one:
        return claims
    bound = abs(phase_one[0].swing) / 2
    for name, wanted in (
        ("end of phase one", phase_one[1:][-1:]),
        ("phase two", [s for s in found.stretches if s not in phase_one]),
    ):
        swings = ", ".join(points_text(s.swing) for s in wanted)
        levels = ", ".join(points_text(s.level) for s in wanted)
        holds = all(abs(s.swing) <= bound and abs(s.level) <= bound for s in wanted)
        claims.append(
            _paper(
                name, "neither side dominates: swing between the learners and distance of the "
                f"level from 0 at most {points_text(bound, sign=False)}, half of iteration 1's "
                "swing",
                _unknown(bool(wanted), f"swing {swings}; level {levels}"),
                holds if wanted and bound > 0.0 else None,
            )
        )  # fmt: skip
    return claims


def _results(found: Reproduction) -> list[Claim]:
    styles = found.styles
    lost, names, enough = "", "", None
    if styles is not None:
        lost = (
            f"{1 - styles.information:.1%} of what tells {styles.policies} policies apart "
            f"({1 - styles.information_of_bouts:.0%} of what tells single bouts apart)"
        )
        names = ", ".join(styles.selected)
        if styles.policies > COMPONENTS + 1:
            enough = styles.information >= INFORMATION
        else:
            lost += f"; {styles.policies} policies always fit into {styles.policies - 1} components"
    return [
        _paper(
            "information lost at three components", "less than 2 %",
            _unknown(styles is not None, lost), enough,
        ),
        _paper(
            "separable styles selected", f"{SELECTED} protagonists",
            _unknown(styles is not None, names),
            None if styles is None else len(styles.selected) == SELECTED,
        ),
    ]  # fmt: skip


def _goals(found: Reproduction) -> list[Claim]:
    styles, tournament = found.styles, found.tournament
    told = ""
    if styles is not None:
        told = share_text(styles.accuracy) + f", chance {styles.chance:.0%}"
        if styles.accuracy_unseen is not None:
            told += f"; against opponents held out {share_text(styles.accuracy_unseen)}"
    share = tournament.camping_share if tournament is not None else 0.0
    claims = [
        _goal(
            "bouts given to the right one of the three by their style",
            f"at least {ACCURACY:.0%}, cross-validated", _unknown(styles is not None, told),
            None if styles is None else styles.accuracy.mean >= ACCURACY,
        ),
        _goal(
            "points from camping, whole tournament", f"at most {CAMPING:.0%}",
            _unknown(tournament is not None, percent_text(share)),
            None if tournament is None else share <= CAMPING,
        ),
    ]  # fmt: skip
    held = [
        one
        for one in (tournament.held if tournament is not None else ())
        if tournament is not None and one.protagonist not in tournament.baselines
    ]
    is_whole = tournament is not None and styles is not None
    claims += [
        _holds("static", [(one, one.below_static) for one in held], 1.0),
        _holds(
            "the heuristic", [(one, one.below_heuristic) for one in held], 0.5,
            _camping_of_the_heuristic(tournament),
        ),
        _holds(
            "a heuristic that does not camp (heuristic-retreating, not the paper's)",
            [(one, one.below_retreating) for one in held], 0.5,
        ),
        _exploited(found),
        _goal(
            "time of all stages", f"at most {MINUTES} min on two cores",
            duration_text(found.seconds) + ("" if is_whole else " so far"),
            found.seconds <= MINUTES * 60 if is_whole else None,
        ),
    ]  # fmt: skip
    return claims


def _camping_of_the_heuristic(tournament: Tournament | None) -> str:
    """Return what the paper's heuristic loses by camping, empty where it hardly does."""
    baselines = tournament.held if tournament is not None else ()
    for one in baselines:
        if one.protagonist == HEURISTIC and one.camping_points > CAMPING * abs(one.score.mean):
            return (
                "the paper's heuristic camps: under the paper's rule "
                f"{points_text(one.camping_points, sign=False)} of the "
                f"{points_text(one.score.mean, sign=False)} points a bout against it are paid "
                "for that; "
            )
    return ""


def _holds(
    baseline: str,
    differences: Sequence[tuple[Held, Score | None]],
    share: float,
    remark: str = "",
) -> Claim:
    """Return whether enough protagonists hold the scripted antagonists lower than a baseline."""
    known = [(one.protagonist, taken) for one, taken in differences if taken is not None]
    sure = [name for name, taken in known if taken.low > 0.0]
    told = "; ".join(
        f"{name} by {points_text(taken.mean)} ({span_text(taken)})" for name, taken in known
    )
    who = "every protagonist" if share == 1.0 else "at least half of the protagonists"
    return _goal(
        f"scripted and simulated antagonists held lower than by {baseline}", who,
        _unknown(bool(known), f"{remark}{len(sure)} of {len(known)} for certain: {told}"),
        len(sure) >= share * len(known) if known else None,
    )  # fmt: skip


def _exploited(found: Reproduction) -> Claim:
    """Return whether fresh best responses take less off the library than off the warm start."""
    warm = [one.score.mean for one in found.exploitability if one.round == 0]
    library = [one.score.mean for one in found.exploitability if one.round]
    is_known = bool(warm) and bool(library)
    told, holds = "", None
    if is_known:
        mean = sum(library) / len(library)
        told = f"{points_text(mean)} on average, warm start {points_text(warm[0])}"
        holds = mean < warm[0]
    return _goal(
        "score of a fresh best response to a protagonist (the antagonist maximises it)",
        "lower than against the warm start", _unknown(is_known, told), holds,
    )  # fmt: skip


def _unknown(is_known: bool, text: str) -> str:
    return text if is_known else "not known yet"


def _paper(about: str, expected: str, found: str, holds: bool | None) -> Claim:
    return Claim(about=about, expected=expected, found=found, holds=holds, source="paper")


def _goal(about: str, expected: str, found: str, holds: bool | None) -> Claim:
    return Claim(about=about, expected=expected, found=found, holds=holds, source="goal")
