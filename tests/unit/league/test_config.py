from typing import Any

import pytest

from services.league.config import LeagueConfig, weight_of


def test_the_defaults_are_in_range() -> None:
    assert LeagueConfig().iterations == 2


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"iterations": 0}, "league.iterations is 0; allowed are 1 to 100"),
        ({"antagonist_updates": 0}, "league.antagonist_updates"),
        ({"convergence_tolerance": float("nan")}, "league.convergence_tolerance is nan"),
        ({"evaluation_bouts": -1}, "league.evaluation_bouts"),
        ({"lease_seconds": 0.1}, "league.lease_seconds is 0.1; allowed are 0.5 to 3600"),
        ({"score_weights": ()}, "league.score_weights is empty"),
        ({"score_weights": (1.0, 1.0, 1.0)}, "has 3 numbers for 2 iterations"),
        ({"shaping_weights": (-1.0,)}, "league.shaping_weights is -1;"),
        ({"score_weights": (1.0, 0.0), "shaping_weights": (0.0,)}, "both 0 in iteration 2"),
    ],
)
def test_values_out_of_range_are_refused_by_name(changes: dict[str, Any], text: str) -> None:
    with pytest.raises(ValueError, match=text.replace(".", r"\.")):
        LeagueConfig(**changes)


def test_the_last_weight_holds_for_the_iterations_after_it() -> None:
    assert [weight_of((1.0, 0.5), iteration) for iteration in (1, 2, 3)] == [1.0, 0.5, 0.5]
