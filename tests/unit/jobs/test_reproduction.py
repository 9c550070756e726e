from pathlib import Path

import msgspec
import numpy as np
import pytest

from services.jobs.report.command import write_report
from services.jobs.report.summarise import Facts, summarise
from services.jobs.report.summary import Origin
from services.jobs.reproduction.draws import Draw, fit_of, replay
from services.jobs.reproduction.parts import Claim, Reproduction
from services.jobs.reproduction.report import gather
from services.jobs.styles import summary as styles_summary
from services.league.history import RunState
from services.league.ledger import open_read_only
from shared.game.rules import RuleBook
from shared.styles.bouts import save
from tests.unit.jobs.ledgers import finished_run
from tests.unit.jobs.two_phases import (
    BOUTS,
    ITERATIONS,
    PEOPLE,
    ROUNDS,
    best_responses,
    bout_table,
    played_run,
)


def report(folder: Path) -> Reproduction:
    write_report(folder, pictures=False)
    return msgspec.json.decode((folder / "reproduction.json").read_bytes(), type=Reproduction)


def gathered(folder: Path) -> Reproduction:
    """Return the numbers without drawing a page."""
    with open_read_only(folder / "league.sqlite") as ledger:
        state = RunState.fold(ledger.replay())
    origin = Origin(command="", commit="", packages={}, python="", machine="")
    facts = Facts(
        folder=str(folder), started_at="", rules=RuleBook(), control_timestep=0.01, origin=origin
    )
    return gather(folder, summarise(state, facts))


def claim(found: Reproduction, about: str) -> Claim:
    return next(one for one in found.claims if one.about.startswith(about))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a run with everything there is."""
    folder = tmp_path_factory.mktemp("both")
    state = played_run(folder)
    table = bout_table(state)
    (folder / "tournament").mkdir()
    save(table, folder / "tournament" / "bouts.parquet")
    cast = styles_summary.cast_of(state, table)
    styles = styles_summary.analyse(cast, table, 7, "trained", "selected", "c0ffee").summary
    (folder / "styles").mkdir()
    (folder / "styles" / "styles.json").write_bytes(msgspec.json.encode(styles))
    best_responses(folder, state)
    return folder


@pytest.fixture(scope="module")
def found(folder: Path) -> Reproduction:
    return report(folder)


def test_the_papers_counts_are_compared_with_those_of_the_run(found: Reproduction) -> None:
    assert claim(found, "iterations of phase one").holds is True
    assert claim(found, "small updates").holds is False
    assert claim(found, "small updates").found.startswith(f"{ITERATIONS}, each 2 PPO updates")
    assert claim(found, "rounds").found == f"{ROUNDS} of {ROUNDS} rounds played out"
    assert claim(found, "bouts of each protagonist").found == f"{ROUNDS * BOUTS}"
    assert claim(found, "bouts of each protagonist").holds is False
    assert claim(found, "reward of phase two").holds is True


def test_the_shape_of_the_learning_curve_is_judged_from_its_numbers(found: Reproduction) -> None:
    by_name = {one.name: one for one in found.stretches}
    assert by_name["phase one, iteration 1"].swing == pytest.approx(2000, abs=150)
    assert by_name["round 2"].swing == pytest.approx(300)
    assert by_name["round 2"].level == pytest.approx(0, abs=1e-6)
    assert claim(found, "phase one, iteration 1").holds is True
    assert claim(found, "end of phase one").holds is True
    assert claim(found, "phase two").holds is True


def test_a_round_that_one_side_dominates_is_said_not_to_match(tmp_path: Path) -> None:
    played_run(tmp_path, swing=4000.0, rounds=1)

    assert claim(gathered(tmp_path), "phase two").holds is False


def test_draws_of_the_sampler_replay_from_the_ledger_and_fit_it(found: Reproduction) -> None:
    everything, *rounds = found.draws
    assert everything.draws == everything.replayed == ROUNDS * ITERATIONS * 2
    assert [one.draws for one in rounds] == [ITERATIONS * 2] * ROUNDS
    assert sum(everything.by_age) == ROUNDS * (ITERATIONS * 2 - 1)  # the first has no choice
    assert sum(everything.by_age_expected) == pytest.approx(sum(everything.by_age))
    assert all(0 <= place <= iteration for one in rounds for _, iteration, place in one.points)
    assert claim(found, "opponents of phase two").holds is True


def test_draws_that_always_take_the_newest_do_not_fit_a_uniform_sampler(folder: Path) -> None:
    with open_read_only(folder / "league.sqlite") as ledger:
        _, draws = replay(ledger.replay())
    generator = np.random.default_rng(0)
    newest = [
        Draw(
            round=one.round, iteration=one.iteration, agent=one.agent, place=one.history - 1,
            history=one.history, probabilities=one.probabilities, is_replayed=False,
        )
        for one in draws
    ]  # fmt: skip

    fair, unfair = fit_of(draws, generator), fit_of(newest, generator)

    assert fair is not None
    assert fair.p > 0.01
    assert unfair is not None
    assert unfair.p < 0.001


def test_the_test_of_draws_rejects_fair_ones_as_often_as_it_says() -> None:
    generator = np.random.default_rng(3)
    rejected = 0
    for _ in range(100):
        draws = [
            Draw(1, k, "antagonist", int(generator.integers(k)), k, np.full(k, 1 / k), True)
            for k in range(2, 22)
        ]
        test = fit_of(draws, generator)
        assert test is not None
        rejected += test.p < 0.1
    assert 2 <= rejected <= 20  # 10 are due; outside with less than 1 in 500


def test_another_sampler_than_the_papers_does_not_match(tmp_path: Path) -> None:
    played_run(tmp_path, sampler="pfsp", rounds=1)
    found = gathered(tmp_path)

    assert claim(found, "opponents of phase two").holds is False
    assert found.draws[0].replayed == found.draws[0].draws


def test_each_protagonist_is_compared_with_the_baselines(found: Reproduction) -> None:
    assert found.tournament is not None
    held = {one.protagonist: one for one in found.tournament.held}
    assert list(held)[:3] == ["static", "heuristic", "heuristic-retreating"]
    assert held["static"].below_static is None
    first, third = held["protagonist 1"], held["protagonist 3"]
    assert first.score.mean == pytest.approx(100, abs=30)
    assert first.score.count == len(PEOPLE) * BOUTS
    assert first.below_static is not None
    assert first.below_static.mean == pytest.approx(1400, abs=40)
    assert third.below_heuristic is not None
    assert third.below_heuristic.low < 0 < third.below_heuristic.high
    assert claim(found, "scripted and simulated antagonists held lower than by static").holds
    told = claim(found, "scripted and simulated antagonists held lower than by the heuristic")
    assert told.holds is True
    assert "2 of 3 for certain" in told.found


def test_what_the_papers_heuristic_loses_by_camping_is_said_and_one_that_does_not_camp_shown(
    found: Reproduction,
) -> None:
    assert found.tournament is not None
    held = {one.protagonist: one for one in found.tournament.held}
    assert held["heuristic"].camping_points == 100.0
    assert held["heuristic-retreating"].camping_points == 0.0
    told = claim(found, "scripted and simulated antagonists held lower than by the heuristic")
    assert told.found.startswith("the paper's heuristic camps: under the paper's rule 100 of the 2")
    told = claim(found, "scripted and simulated antagonists held lower than by a heuristic that")
    assert told.holds is False
    assert told.found.startswith("1 of 3 for certain: protagonist 1 by +")


def test_camping_is_a_share_of_all_points_given_and_taken(found: Reproduction) -> None:
    assert found.tournament is not None
    by_names = {(cell.antagonist, cell.protagonist): cell for cell in found.tournament.cells}
    # 20 points of camping, 1,000 of penalties, about 1,080 of attacks
    assert by_names["stab", "protagonist 1"].camping_share == pytest.approx(20 / 2100, rel=0.1)
    assert by_names["stab", "protagonist 2"].camping_share == 0.0
    assert 0.0 < found.tournament.camping_share < 0.01


def test_styles_and_best_responses_are_taken_over(found: Reproduction) -> None:
    assert found.styles is not None
    assert found.styles.policies == ROUNDS
    assert found.styles.accuracy.mean > 0.9
    assert claim(found, "information lost").holds is None  # three policies lose nothing
    by_name = {one.name: one for one in found.exploitability}
    assert by_name["warm start"].samples == 500_000
    assert by_name["warm start"].score.mean == 910.0
    assert by_name["round 3"].highest == 620.0
    assert claim(found, "score of a fresh best response").holds is True
    assert found.missing == ()


def test_the_page_shows_every_part_and_asks_for_nothing(folder: Path, found: Reproduction) -> None:
    text = (folder / "reproduction.html").read_text(encoding="utf-8")
    assert text.count("<svg") == 2
    for word in ("protagonist 3", "effective number of styles", "below heuristic", "chi-square"):
        assert word in text
    assert "default-src &#x27;none&#x27;" in text
    for loading in ('src="http', 'href="http', "url(http", "<script"):
        assert loading not in text


def test_parts_that_are_not_there_are_named_with_their_commands(tmp_path: Path) -> None:
    played_run(tmp_path, rounds=1)
    found = report(tmp_path)

    assert [one.part for one in found.missing] == ["tournament", "styles", "exploitability"]
    assert f"riposte tournament {tmp_path}" in (tmp_path / "reproduction.html").read_text("utf-8")
    assert claim(found, "information lost").holds is None
    assert claim(found, "time of all stages").holds is None


def test_damaged_parts_are_named_and_do_not_stop_the_report(tmp_path: Path) -> None:
    played_run(tmp_path, rounds=1)
    for name in ("tournament/bouts.parquet", "styles/styles.json", "exploitability/x.json"):
        (tmp_path / name).parent.mkdir()
        (tmp_path / name).write_bytes(b"{]")
    found = gathered(tmp_path)

    assert [bool(one.reason) for one in found.missing] == [True] * 3


def test_a_run_of_phase_one_has_no_reproduction_report(tmp_path: Path) -> None:
    write_report(finished_run(tmp_path), pictures=False)

    assert not (tmp_path / "reproduction.html").exists()
