import pytest

from benchmarks.seeds import iqm_interval, ratio_interval


def test_the_lowest_and_the_highest_quarter_do_not_count():
    found = iqm_interval([100.0, 4.0, 5.0, 6.0, 0.0])
    assert found.value == 5.0
    assert found.low is not None
    assert found.high is not None
    assert 0.0 < found.low < 5.0 < found.high < 100.0


def test_seeds_that_agree_have_no_interval():
    assert iqm_interval([7.0] * 5) == (7.0, None, None)


def test_a_ratio_has_the_interval_of_both():
    one, other = [9.0, 10.0, 11.0, 10.0, 10.0], [19.0, 20.0, 21.0, 20.0, 20.0]
    found = ratio_interval(one, other)
    assert found.value == pytest.approx(0.5)
    assert found.low is not None
    assert found.high is not None
    assert 0.45 < found.low < 0.5 < found.high < 0.55
    assert ratio_interval(other, one).value == pytest.approx(2.0)
