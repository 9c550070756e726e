"""Every lie is one: the wire or the learner's own check refuses it, whatever its name says."""

import pytest

from services.jobs.chaos.lies import FORGED, FORGERIES, LIES
from shared.errors import MessageError
from shared.messages.topics import ROLLOUT
from shared.messages.training import Rollout
from shared.messages.wire import decode, encode
from tests.unit.learner.making import rollout

ON_THE_WIRE = {"not a number", "infinite", "wrong shape", "damaged bytes", "huge"}


def arrives(lie: str) -> Rollout:
    """What the learner would get to see."""
    payload = encode(LIES[lie](rollout(sequence=3)))
    return decode(Rollout, FORGERIES.get(lie, bytes)(payload), ROLLOUT.max_bytes)


@pytest.mark.parametrize("lie", sorted(ON_THE_WIRE))
def test_a_broken_rollout_does_not_get_past_the_wire(lie: str):
    with pytest.raises(MessageError):
        arrives(lie)


@pytest.mark.parametrize("lie", sorted(LIES.keys() - ON_THE_WIRE - {"sent again"}))
def test_a_false_rollout_gets_there_under_a_name_of_its_own(lie: str):
    assert arrives(lie).sequence == 3 + FORGED


def test_the_truth_told_twice_keeps_its_name():
    assert arrives("sent again").name == rollout(sequence=3).name


def test_a_wrong_shape_is_refused_for_its_shape():
    with pytest.raises(MessageError, match="obs has shape"):
        arrives("wrong shape")
