import dataclasses

import numpy as np
import pytest

from shared.styles.payoff import RESAMPLES, Payoff, payoff_of
from shared.styles.ratings import ELO, fit_bradley_terry, nash_of, ratings_of, refit, solve
from tests.unit.styles.making import table

A = np.array([-250.0, 0.0, 250.0])
P = np.array([-150.0, -50.0, 50.0, 150.0])
ADVANTAGE = 80.0


def league(antagonists: np.ndarray, protagonists: np.ndarray, bouts: int, seed: int) -> Payoff:
    """Return bouts between players of these strengths (Elo), won by chance."""
    odds = np.exp((antagonists[:, None] - protagonists + ADVANTAGE) / ELO)
    wins = np.random.default_rng(seed).binomial(bouts, odds / (1.0 + odds))
    made = payoff_of(table(len(antagonists), len(protagonists), 2), np.random.default_rng(0))
    return dataclasses.replace(made, wins=wins, bouts=np.full(wins.shape, bouts))


def with_mean(mean: list[list[float]], noise: float = 0.0) -> Payoff:
    matrix = np.array(mean)
    made = payoff_of(table(*matrix.shape, 2), np.random.default_rng(0))
    jitter = noise * np.random.default_rng(1).standard_normal((RESAMPLES, *matrix.shape))
    return dataclasses.replace(made, mean=matrix, resampled=matrix + jitter)


def test_known_strengths_are_recovered_within_their_intervals():
    held = total = 0
    for seed in range(4):
        payoff = league(A, P, 100, seed)
        found = ratings_of(payoff, np.random.default_rng(seed))
        for pool, players, true in (
            (found.antagonists, payoff.antagonists, A),
            (found.protagonists, payoff.protagonists, P),
        ):
            by_player = {rating.player: rating.elo for rating in pool}
            for player, strength in zip(players, true, strict=True):
                total += 1
                held += by_player[player].low <= strength <= by_player[player].high
                assert by_player[player].value == pytest.approx(strength, abs=90.0)
        advantage = found.antagonist_advantage
        assert advantage.low <= ADVANTAGE <= advantage.high
    assert held >= 0.85 * total


def test_ratings_come_strongest_first_with_the_share_of_bouts_won():
    payoff = league(A, P, 100, 0)
    found = ratings_of(payoff, np.random.default_rng(0))
    assert [rating.player for rating in found.antagonists] == list(reversed(payoff.antagonists))
    assert found.antagonists[0].bouts == 400
    assert found.antagonists[0].win_share == payoff.wins[2].sum() / 400
    assert found.protagonists[0].win_share == 1.0 - payoff.wins[:, 3].sum() / 300


def test_who_wins_every_bout_gets_a_finite_rating_inside_its_interval():
    payoff = league(A, P, 100, 0)
    payoff.wins[2] = 100
    found = ratings_of(payoff, np.random.default_rng(0)).antagonists[0]
    assert found.player == payoff.antagonists[2]
    assert found.elo.low < found.elo.value < found.elo.high
    assert 400.0 < found.elo.value < 2000.0
    assert found.elo.high - found.elo.low > 50.0


def test_more_bouts_narrow_the_intervals():
    widths = [
        ratings_of(league(A, P, bouts, 0), np.random.default_rng(0)).antagonist_advantage
        for bouts in (25, 400)
    ]
    assert (widths[0].high - widths[0].low) > 2.5 * (widths[1].high - widths[1].low)


def test_pairings_not_played_do_not_count():
    payoff = league(A, P, 100, 0)
    payoff.bouts[0, 1] = payoff.wins[0, 1] = 0
    found = ratings_of(payoff, np.random.default_rng(0))
    weakest = next(r for r in found.antagonists if r.player == payoff.antagonists[0])
    assert weakest.bouts == 300
    assert weakest.elo.value == pytest.approx(A[0], abs=100.0)


def test_fits_for_the_intervals_are_those_of_the_library():
    payoff = league(A, P, 100, 0)
    played = payoff.bouts > 0
    total = payoff.bouts + 1.0
    begin = fit_bradley_terry(payoff.wins + 0.5, total - payoff.wins - 0.5, played)
    shares = np.random.default_rng(0).uniform(0.005, 0.995, (3, *total.shape))
    for share, found in zip(shares, refit(begin, total, shares, played), strict=True):
        library = fit_bradley_terry(total * share, total * (1.0 - share), played)
        np.testing.assert_allclose(found, library, atol=1e-5)


def test_rock_paper_scissors_is_played_evenly_by_both_sides():
    nash = nash_of(with_mean([[0, -100, 100], [100, 0, -100], [-100, 100, 0]]))
    for side in (nash.antagonists, nash.protagonists):
        assert [player.weight.value for player in side] == pytest.approx([1 / 3] * 3)
        assert [player.exploitability.value for player in side] == pytest.approx([100.0] * 3)
    assert nash.value.value == pytest.approx(0.0, abs=1e-6)
    assert nash.antagonists[0].best_response == nash.protagonists[1].player


def test_a_dominated_player_gets_no_weight():
    nash = nash_of(with_mean([[300, 200], [100, 50], [250, 260]]))
    assert nash.antagonists[1].weight.value == 0.0
    assert nash.antagonists[1].exploitability.value > 150.0
    assert sum(player.weight.value for player in nash.antagonists) == pytest.approx(1.0)


def test_the_mixtures_are_those_nobody_can_exploit():
    generator = np.random.default_rng(5)
    for _ in range(20):
        payoff = generator.normal(0.0, 800.0, (5, 7))
        found = solve(payoff)
        rows, columns = found.mixtures
        assert (rows @ payoff).min() == pytest.approx(found.value)
        assert (payoff @ columns).max() == pytest.approx(found.value)
        assert min(found.exploitability[0].min(), found.exploitability[1].min()) >= -1e-6


def test_a_pure_equilibrium_is_found_and_its_players_cannot_be_exploited():
    found = solve(np.array([[5.0, 9.0], [1.0, 7.0]]))
    assert found.value == pytest.approx(5.0)
    assert found.mixtures[0].tolist() == [1.0, 0.0]
    assert found.mixtures[1].tolist() == [1.0, 0.0]
    assert found.exploitability[0].tolist() == pytest.approx([0.0, 4.0])
    assert found.exploitability[1].tolist() == pytest.approx([0.0, 4.0])


def test_noise_in_the_scores_shows_in_the_intervals():
    even = [[0.0, -100.0, 100.0], [100.0, 0.0, -100.0], [-100.0, 100.0, 0.0]]
    sure, unsure = nash_of(with_mean(even, 1.0)), nash_of(with_mean(even, 30.0))
    for nash in (sure, unsure):
        weight = nash.antagonists[0].weight
        assert weight.low < 1 / 3 < weight.high
    assert sure.antagonists[0].weight.high - sure.antagonists[0].weight.low < 0.05
    assert unsure.antagonists[0].weight.high - unsure.antagonists[0].weight.low > 0.1


def test_an_incomplete_tournament_has_no_equilibrium():
    payoff = with_mean([[0.0, 1.0]])
    payoff.bouts[0, 1] = 0
    with pytest.raises(ValueError, match="every pairing needs bouts"):
        nash_of(payoff)
