import numpy as np
import pytest

from studies.closing_the_loop.gains import rows_of


def scores(rng: np.random.Generator, gain: float) -> dict:
    """Return scores of 3 seeds, 2 antagonists, 40 bouts; bouts differ far more than policies."""
    bouts = rng.normal(500.0, 300.0, (1, 2, 40))
    made = {}
    for name, less in (("nominal", 0.0), ("base_fit", 0.0), ("extended", gain)):
        made[name] = bouts - less + rng.normal(0.0, 20.0, (3, 1, 1)) + rng.normal(0, 5, (3, 2, 40))
    return made


def test_a_gain_is_found_although_bouts_differ_more_than_policies():
    rows = rows_of(scores(np.random.default_rng(1), 150.0), ("stab", "slash"), 0)
    assert [row.antagonist for row in rows] == ["stab", "slash", "all"]
    for row in rows:
        assert row.gains["extended"].is_sure
        assert row.gains["extended"].mean == pytest.approx(150.0, abs=45.0)
        assert row.gains["extended"].low < row.gains["extended"].mean < row.gains["extended"].high
    whole = rows[-1]
    assert whole.points["nominal"].mean == pytest.approx(
        np.mean([row.points["nominal"].mean for row in rows[:2]])
    )
    assert whole.gains["extended"].mean == pytest.approx(
        whole.points["nominal"].mean - whole.points["extended"].mean
    )


def test_where_there_is_no_gain_none_is_sure_beyond_chance():
    sure = sum(
        rows_of(scores(np.random.default_rng(seed), 0.0), ("stab", "slash"), seed)[-1]
        .gains["extended"]
        .is_sure
        for seed in range(4)
    )
    # three seeds resampled are a narrow sample: the interval of a null misses 0 more than 1 in 20
    assert sure <= 2


def test_an_interval_of_equal_seeds_is_that_of_the_bouts():
    values = np.tile(np.arange(50.0), (3, 1, 1)).reshape(3, 1, 50)
    same = {"nominal": values, "base_fit": values, "extended": values - 1.0}
    row = rows_of(same, ("stab",), 0)[0]  # type: ignore[arg-type]
    assert row.gains["extended"].low == pytest.approx(1.0)
    assert row.gains["extended"].high == pytest.approx(1.0)
    spread = row.points["nominal"].high - row.points["nominal"].low
    assert spread == pytest.approx(2.0 * 1.96 * values[0].std() / np.sqrt(50.0), rel=0.1)
