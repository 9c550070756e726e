"""No path names a cause that did not pass the gate, whatever the losses are."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shared.identification.conclusion import causes
from shared.identification.conclusion.conclude import conclude
from shared.identification.search.rivals import simplest
from shared.identification.search.searched import Model
from tests.searches import DRAG, ELBOW, LIFT, OFFSET, Searches

LOSSES = st.lists(st.floats(0.3, 300.0), min_size=6, max_size=6).map(np.array)


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    return Searches(tmp_path_factory.mktemp("data"))


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(base=LOSSES, after=st.lists(LOSSES, min_size=3, max_size=3), doubted=st.booleans(),
       is_event=st.booleans(), is_beside=st.booleans())  # fmt: skip
def test_causes_are_named_only_if_they_passed(
    searches: Searches,
    base: np.ndarray,
    after: list[np.ndarray],
    doubted: bool,
    is_event: bool,
    is_beside: bool,
):
    tried = tuple(
        searches.tried(candidate, base, losses, numbers, is_event and candidate is DRAG)
        for candidate, losses, numbers in zip((ELBOW, LIFT, DRAG), after, (1, 1, 2), strict=True)
    )
    mean = float(base.mean())
    useful = [each for each in tried if each.is_event or each.gain.is_useful(mean)]
    names = ("mass elbow",) if doubted else ()
    passed = {each.candidate.label for each in useful}
    if useful:
        taken, rivals = simplest(useful, np.random.default_rng(0))
        before = (searches.tried(OFFSET, base, base),) if is_beside else ()  # passed earlier
        passed |= {each.candidate.label for each in before}
        found = searches.search(base, taken, rivals, names, tried, before)
    else:
        found = searches.search(base, doubted=names, tried=tried)
    with pytest.MonkeyPatch.context() as patch:  # losses are made up, so are those without a cause
        patch.setattr(causes, "without", lambda *_: Model(found.base, base))
        told = conclude(found, ())
    assert (told.word == "tie") == bool(told.ties)
    assert told.word in ("named", "tie") or not told.causes
    if told.word == "named":
        assert told.causes
    tied = {f"{each.effect} {each.where}" for tie in told.ties for each in tie.causes}
    assert not tied & {f"{each.effect} {each.where}" for each in told.causes}
    for cause in (*told.causes, *(each for tie in told.ties for each in tie.causes)):
        assert f"{cause.effect} {cause.where}" in passed
        assert np.isfinite([cause.interval.low, cause.interval.high]).all()
    if told.word in ("none", "base_too_coarse"):
        assert not passed
    assert set(found.tried) == {f"{each.effect} {each.where}" for each in told.candidates}
