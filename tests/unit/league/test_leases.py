import pytest

from services.league.config import LeagueConfig
from services.league.history import RunState
from services.league.leases import MOST_SAMPLES, LeaseTable, lease_seed, lease_window


def test_lease_seeds_follow_from_run_and_number_and_do_not_repeat() -> None:
    seeds = [lease_seed(run, number) for run in range(20) for number in range(1, 200)]
    assert len(set(seeds)) == len(seeds)
    assert seeds[0] == lease_seed(0, 1)
    assert all(0 <= seed < 2**63 for seed in seeds)


@pytest.mark.parametrize(("actors", "window"), [(0, 10), (1, 10), (2, 5), (3, 4), (4, 3), (99, 1)])
def test_the_window_gives_all_actors_two_batches_together(actors: int, window: int) -> None:
    assert lease_window(LeagueConfig(batch_rollouts=5), actors, serial=False) == window
    assert lease_window(LeagueConfig(batch_rollouts=5), actors, serial=True) == 5


@pytest.mark.parametrize("sizes", [[5120], [1280], [5120, 1280, 1280, 1280], [1], [7] * 50])
def test_actors_of_any_size_have_a_batch_and_another_under_way_together(sizes: list[int]) -> None:
    cfg = LeagueConfig(batch_samples=20480)
    windows = [lease_window(cfg, len(sizes), size, serial=False) for size in sizes]
    under_way = sum(size * window for size, window in zip(sizes, windows, strict=True))
    assert under_way >= 2 * cfg.batch_samples
    assert lease_window(cfg, 1, MOST_SAMPLES, serial=False) == 1


def with_live(*leases: str) -> RunState:
    state = RunState()
    state.live_leases = dict.fromkeys(leases)
    return state


def test_leases_lapse_in_the_order_of_their_last_renewals() -> None:
    state = with_live("L1", "L2", "L3")
    table = LeaseTable(10.0, state.live_leases, now=0.0)
    table.renew("L1", 4.0)
    table.renew("L4", 5.0)
    state.live_leases["L4"] = None
    assert table.lapsed(state, 9.9) == []
    assert table.lapsed(state, 10.0) == ["L2", "L3"]
    assert table.lapsed(state, 15.0) == ["L1", "L4"]
    assert table.lapsed(state, 99.0) == []


def test_a_lease_that_has_ended_does_not_lapse_nor_hide_those_behind_it() -> None:
    state = with_live("L1", "L2", "L3")
    table = LeaseTable(10.0, state.live_leases, now=0.0)
    table.renew("L1", 5.0)
    del state.live_leases["L2"]
    assert table.lapsed(state, 12.0) == ["L3"]
    del state.live_leases["L1"]
    assert table.lapsed(state, 99.0) == []
