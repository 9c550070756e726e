import msgspec
import pytest

from services.study.view import (
    MAX_ANSWERS,
    MAX_BYTES,
    MAX_CHOICES,
    MAX_TEXT,
    Answer,
    ParticipantAsk,
    parse_participant_ask,
    parse_researcher_ask,
)
from shared.errors import MessageError


def test_an_ask_of_each_page_is_read():
    ask = parse_researcher_ask(b'{"id":"a-1","action":"void","step":"s1-g02","attempt":2}')
    assert (ask.id, ask.action, ask.step, ask.attempt) == ("a-1", "void", "s1-g02", 2)
    said = parse_participant_ask(
        '{"id":"b","action":"answers","step":"q","answers":[{"item":"PU","value":5},'
        '{"item":"adj","choices":["Joyful"]},{"item":"rank","ranks":[2,1,2]}]}'
    )
    assert said.answers == (
        Answer(item="PU", value=5),
        Answer(item="adj", choices=("Joyful",)),
        Answer(item="rank", ranks=(2, 1, 2)),
    )


@pytest.mark.parametrize(
    "text",
    [
        "", "{", "[]", "null", '{"id":"a"}', '{"action":"next"}', '{"id":"","action":"next"}',
        '{"id":"a b","action":"next"}', '{"id":"a\\n","action":"next"}',
        '{"id":"a","action":"ready"}', '{"id":"a","action":"next","more":1}',
        '{"id":"a","action":"void","attempt":-1}', '{"id":"a","action":"void","attempt":1.5}',
        '{"id":"a","action":"next","step":"\\ud800"}', '{"id":"a","action":"next","reason":7}',
        f'{{"id":"a","action":"note","text":"{"x" * (MAX_TEXT + 1)}"}}',
        f'{{"id":"{"a" * 65}","action":"next"}}',
    ],
)  # fmt: skip
def test_what_is_no_researchers_ask_is_refused(text: str):
    with pytest.raises(MessageError, match="a researcher's ask cannot be read"):
        parse_researcher_ask(text)


@pytest.mark.parametrize(
    "answers",
    [
        '{"item":"a","value":0}', '{"item":"a","value":12}', '{"item":"a","value":2.5}',
        '{"value":1}', '{"item":"a","ranks":[0]}', '{"item":"a","choices":"b"}',
        '{"item":"a","more":1}', ",".join(['{"item":"a"}'] * (MAX_ANSWERS + 1)),
    ],
)  # fmt: skip
def test_what_is_no_answer_is_refused(answers: str):
    text = f'{{"id":"a","action":"answers","step":"q","answers":[{answers}]}}'
    with pytest.raises(MessageError, match="a participant's ask cannot be read"):
        parse_participant_ask(text)


def test_the_longest_answers_that_are_taken_fit_into_one_message():
    longest = Answer(
        item="\x01" * 400, ranks=(MAX_CHOICES,) * MAX_CHOICES, text="\x01" * MAX_TEXT
    )  # a control character is the longest in JSON
    ask = ParticipantAsk(id="a" * 64, action="answers", step="q", answers=(longest,) * MAX_ANSWERS)
    encoded = msgspec.json.encode(ask)
    assert len(encoded) <= MAX_BYTES
    assert parse_participant_ask(encoded) == ask
