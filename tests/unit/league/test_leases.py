import pytest

from services.league.config import LeagueConfig
from services.league.leases import lease_seed, lease_window


def test_lease_seeds_follow_from_run_and_number_and_do_not_repeat() -> None:
    seeds = [lease_seed(run, number) for run in range(20) for number in range(1, 200)]
    assert len(set(seeds)) == len(seeds)
    assert seeds[0] == lease_seed(0, 1)
    assert all(0 <= seed < 2**63 for seed in seeds)


@pytest.mark.parametrize(("actors", "window"), [(0, 10), (1, 10), (2, 5), (3, 4), (4, 3), (99, 1)])
def test_the_window_gives_all_actors_two_batches_together(actors: int, window: int) -> None:
    assert lease_window(LeagueConfig(batch_rollouts=5), actors, serial=False) == window
    assert lease_window(LeagueConfig(batch_rollouts=5), actors, serial=True) == 5
