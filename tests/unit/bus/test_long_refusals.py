"""A refusal that would quote all of what it refuses is cut, and whoever answers lives."""

import pytest

from shared.bus.base import Refused
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.errors import MessageError
from shared.messages.topics import ROLLOUT
from shared.messages.training import Receipt, Rollout
from shared.messages.wire import MAX_TEXT, decode, encode
from tests.unit.learner.making import rollout

LONG = "x" * MAX_TEXT


def test_a_word_that_is_none_of_those_allowed_is_quoted_in_part() -> None:
    payload = encode(rollout(agent=LONG))
    with pytest.raises(MessageError, match="Invalid enum value") as error:
        decode(Rollout, payload, ROLLOUT.max_bytes)
    assert len(str(error.value)) < 1000


@pytest.mark.parametrize("field", ["agent", "opponent"])
def test_an_inbox_refuses_it_and_goes_on(field: str) -> None:
    hub = MemoryHub(ManualClock())
    learner, actor = hub.join("learner-antagonist"), hub.join("actor-0")
    inbox = learner.answer(ROLLOUT, agent="antagonist")
    odd = actor.ask(ROLLOUT, rollout(**{field: LONG}), 5.0, agent="antagonist")
    if (request := inbox.take()) is not None:
        request.refuse(f"the opponent is {request.message.opponent}")
    answer = odd.take()
    assert isinstance(answer, Refused)
    assert len(answer.reason) < 1000
    plain = actor.ask(ROLLOUT, rollout(), 5.0, agent="antagonist")
    request = inbox.take()
    assert request is not None
    request.reply(Receipt(accepted=True))
    assert plain.take() == Receipt(accepted=True)
