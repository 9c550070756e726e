import pytest

from services.study.forms import items_of, lacks_of
from services.study.view import Answer, Item
from shared.errors import ConfigError
from shared.study.protocol_file import SHIPPED, load_protocol, read_protocol, shipped_protocol

ITEMS = (
    Item(id="PU", text="", scale="points", points=5),
    Item(id="one", text="", scale="choices", options=("a", "b"), is_required=False),
    Item(id="adj", text="", scale="choices", options=("a", "b"), is_several=True, other="b"),
    Item(id="rank", text="", scale="ranking", options=("1", "2")),
    Item(id="why", text="", scale="open", is_required=False),
)
WHOLE = (
    Answer(item="PU", value=5),
    Answer(item="one", choices=("a",)),
    Answer(item="adj", choices=("a", "b"), text="else"),
    Answer(item="rank", ranks=(1, 1)),
    Answer(item="why", text="because"),
)


def test_whole_answers_lack_nothing():
    assert lacks_of(ITEMS, WHOLE) == []


def test_what_is_free_may_be_left_out_and_what_is_not_is_named():
    assert lacks_of(ITEMS, ()) == [
        "PU has no answer", "adj has no answer", "rank has no answer",
    ]  # fmt: skip
    kept = [answer for answer in WHOLE if answer.item not in ("one", "why")]
    assert lacks_of(ITEMS, [*kept, Answer(item="one"), Answer(item="why", text="  ")]) == []


@pytest.mark.parametrize(
    ("answer", "lack"),
    [
        (Answer(item="PU", value=6), "PU is 6, expected at most 5"),
        (Answer(item="PU", value=5, text="x"), "PU has a text, expected none"),
        (Answer(item="PU", value=5, choices=("a",)), "PU has no option 'a'"),
        (Answer(item="one", choices=("c",)), "one has no option 'c'"),
        (Answer(item="one", choices=("a", "b")), "one has 2 options, expected one"),
        (Answer(item="one", choices=("a",), value=1), "one is 1, expected at most 0"),
        (Answer(item="adj", choices=("a", "a")), "adj has an option twice"),
        (Answer(item="adj", choices=("a",), text="else"), "adj has a text, expected none"),
        (Answer(item="rank", ranks=(1,)), "rank has ranks [1], expected 2 of 1 to 2"),
        (Answer(item="rank", ranks=(1, 3)), "rank has ranks [1, 3], expected 2 of 1 to 2"),
        (Answer(item="why", text="x", ranks=(1,)), "why has ranks [1], expected 0 of 1 to 0"),
        (Answer(item="else", value=1), "there is no question 'else' here"),
    ],
)
def test_an_answer_that_does_not_fit_is_named(answer: Answer, lack: str):
    kept = [each for each in WHOLE if each.item != answer.item]
    assert lacks_of(ITEMS, [*kept, answer]) == [lack]


def test_an_empty_answer_holds_nothing_else():
    kept = [answer for answer in WHOLE if answer.item != "why"]
    assert lacks_of(ITEMS, [*kept, Answer(item="why", value=3)]) == ["why is 3, expected at most 0"]


def test_a_question_is_answered_once():
    assert lacks_of(ITEMS, [*WHOLE, WHOLE[0]]) == ["a question is answered twice"]


@pytest.mark.parametrize("name", SHIPPED)
def test_every_question_of_the_shipped_protocols_becomes_an_item(name: str):
    sections = (1, 2)
    for instrument in load_protocol(shipped_protocol(name)).instrument:
        items = items_of(instrument, sections)
        assert [item.text for item in items] == [item.text for item in instrument.item]
        for item, source in zip(items, instrument.item, strict=True):
            assert item.is_required != source.is_optional
            assert item.points == (source.scale if isinstance(source.scale, int) else 0)
            assert item.options == (("1", "2") if source.scale == "ranking" else source.options)
            assert item.ends == (source.ends or ("", ""))


def test_a_protocol_says_in_which_language_it_is():
    data = shipped_protocol("template").read_bytes()
    assert read_protocol(data, "t.toml").language == "en"
    german = b'language = "de"\n' + data
    assert read_protocol(german, "t.toml").language == "de"
    with pytest.raises(ConfigError, match="a language such as en or de-CH"):
        read_protocol(german.replace(b'"de"', b'"Deutsch"'), "t.toml")
