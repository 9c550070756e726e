"""What speaks for a cause."""

import numpy as np
import pytest

from shared.identification.searched import Model, foretells, judged
from tests.searches import ELBOW, Searches

_USUAL = 1.0 + 0.2 * np.sin(np.arange(22.0))
_EVENT = _USUAL + np.where(np.arange(22) == 7, 10.0, 0.0) + np.where(np.arange(22) == 8, 15.0, 0.0)


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (_EVENT, _USUAL, True),
        (_EVENT, np.where(np.arange(22) == 8, 7.0, _USUAL), False),  # something still stands out
        (_EVENT, np.where(np.arange(22) == 3, 9.0, _USUAL), False),  # elsewhere, now
        (_USUAL + 2.0, _USUAL, False),  # nothing stood out
        (_EVENT, np.minimum(_EVENT, 5.9), False),  # half of it is no explanation
    ],
)
def test_a_cause_foretells_an_event_if_nothing_of_it_is_left(before, after, told: bool):
    assert foretells(before, after) is told


def test_an_event_that_a_cause_foretells_makes_it_sure(tmp_path):
    searches = Searches(tmp_path)
    found = searches.search(_EVENT)
    before = Model(searches.base, _EVENT)
    fit = searches.tried(ELBOW, _EVENT, _USUAL).fit
    assert judged(found, ELBOW, before, Model(fit, _USUAL)).gain.is_sure
    some = np.where(np.arange(22) == 8, 7.0, _USUAL)
    assert not judged(found, ELBOW, before, Model(fit, some)).gain.is_sure
