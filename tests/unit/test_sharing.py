"""Tests that share something stay together, and those that have to keep time come last."""

import pytest

from tests.sharing import company, turn

PAGE = "tests/integration/page/test_browser.py::test_a"
BUS = "tests/integration/bus/test_zenoh.py::test_b[::1]"
TRAIN = "tests/integration/training/test_train.py::test_c"
LONG = "tests/integration/identification/test_hidden_effects.py::test_d[payload]"
UNIT = "tests/unit/league/test_ledger.py::test_e"


@pytest.mark.parametrize(
    ("one", "other", "is_together"),
    [
        (PAGE, BUS, True),
        (UNIT, UNIT.replace("test_e", "test_f"), True),
        (UNIT, UNIT.replace("ledger", "service"), False),
        (LONG, LONG.replace("payload", "backlash"), False),
        (TRAIN, TRAIN.replace("train.py", "kill.py"), True),
        (TRAIN, PAGE, False),
    ],
)
def test_which_tests_stay_with_one_worker(one: str, other: str, is_together: bool) -> None:
    assert (company(one) == company(other)) is is_together


def test_whole_jobs_come_first_and_what_keeps_time_last() -> None:
    assert sorted((PAGE, UNIT, LONG, TRAIN), key=turn) == [TRAIN, LONG, UNIT, PAGE]
