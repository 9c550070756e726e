"""Any answer that a page can make of a form is taken; any other is refused in words."""

import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from services.study.forms import is_empty, lacks_of
from services.study.view import (
    MAX_CHOICES,
    MAX_POINTS,
    MAX_TEXT,
    Answer,
    Item,
    ParticipantAsk,
    parse_participant_ask,
)

TEXT = st.text(st.characters(codec="utf-8"), max_size=30)


@st.composite
def items(draw: st.DrawFn, name: str) -> Item:
    scale = draw(st.sampled_from(["points", "choices", "ranking", "open"]))
    options = draw(st.lists(TEXT.filter(str.strip), min_size=2, max_size=5, unique=True))
    if scale == "ranking":
        options = [str(k + 1) for k in range(len(options))]
    return Item(
        id=name, text="?", scale=scale, points=draw(st.integers(2, MAX_POINTS)),
        options=tuple(options) if scale in ("choices", "ranking") else (),
        is_several=scale == "choices" and draw(st.booleans()),
        other=options[0] if scale == "choices" and draw(st.booleans()) else "",
        is_required=draw(st.booleans()),
    )  # fmt: skip


@st.composite
def filled(draw: st.DrawFn, item: Item) -> Answer:
    if item.scale == "points":
        return Answer(item=item.id, value=draw(st.integers(1, item.points)))
    if item.scale == "ranking":
        count = len(item.options)
        places = draw(st.lists(st.integers(1, count), min_size=count, max_size=count))
        levels = sorted(set(places))
        return Answer(item=item.id, ranks=tuple(levels.index(place) + 1 for place in places))
    if item.scale == "open":
        return Answer(item=item.id, text=draw(TEXT.filter(str.strip)))
    most = len(item.options) if item.is_several else 1
    chosen = draw(st.lists(st.sampled_from(item.options), min_size=1, max_size=most, unique=True))
    text = draw(TEXT) if item.other in chosen else ""
    return Answer(item=item.id, choices=tuple(chosen), text=text)


@st.composite
def forms(draw: st.DrawFn) -> tuple[list[Item], list[Answer]]:
    made = [draw(items(f"q{k}")) for k in range(draw(st.integers(1, 4)))]
    return made, [draw(filled(item)) for item in made]


ANY = st.builds(
    Answer, item=st.sampled_from(["q0", "q1", "else"]),
    value=st.none() | st.integers(1, MAX_POINTS),
    choices=st.lists(TEXT, max_size=3).map(tuple),
    ranks=st.lists(st.integers(1, MAX_CHOICES), max_size=4).map(tuple),
    text=TEXT,
)  # fmt: skip


@settings(max_examples=30)
@given(forms())
def test_what_a_page_makes_of_a_form_lacks_nothing(form: tuple[list[Item], list[Answer]]):
    made, answers = form
    assert lacks_of(made, answers) == []
    for item in made:
        left_out = [answer for answer in answers if answer.item != item.id]
        assert lacks_of(made, left_out) == ([f"{item.id} has no answer"] * item.is_required)


@settings(max_examples=30)
@given(forms(), st.lists(ANY, max_size=4))
def test_what_lacks_nothing_answers_every_required_item_and_fits_it(
    form: tuple[list[Item], list[Answer]], answers: list[Answer]
):
    made, _ = form
    if lacks_of(made, answers):
        return
    given_to = {answer.item: answer for answer in answers}
    assert len(given_to) == len(answers)
    assert set(given_to) <= {item.id for item in made}
    for item in made:
        answer = given_to.get(item.id)
        if answer is None or is_empty(item, answer):
            assert not item.is_required
        if answer is not None:
            assert set(answer.choices) <= set(item.options)
            assert item.scale == "points" or answer.value is None
            assert item.scale == "ranking" or answer.ranks == ()


@settings(max_examples=30)
@given(st.lists(ANY, max_size=5), TEXT)
def test_an_ask_comes_through_the_wire_as_it_was_said(answers: list[Answer], step: str):
    ask = ParticipantAsk(id="a-1", action="answers", step=step, answers=tuple(answers))
    assert parse_participant_ask(msgspec.json.encode(ask)) == ask
    assert all(len(answer.text) <= MAX_TEXT for answer in answers)
