"""Protocols: what ships is the paper's, and what is wrong is named with line and field."""

import re

import pytest

from shared.errors import ConfigError
from shared.study.protocol_file import (
    SHIPPED,
    load_protocol,
    read_protocol,
    shipped_protocol,
)
from shared.study.steps import steps_of

ONE = shipped_protocol("study-one").read_text(encoding="utf-8")


def conditions_of(protocol):
    return [condition.name for condition in protocol.condition]


@pytest.mark.parametrize("name", SHIPPED)
def test_what_ships_can_be_read_and_laid_out(name):
    protocol = load_protocol(shipped_protocol(name))
    steps = steps_of(protocol, conditions_of(protocol))
    assert steps[0].kind == "consent"
    assert steps[-1].kind == "debrief"
    assert len({step.id for step in steps}) == len(steps)


def test_study_one_is_the_papers():
    protocol = load_protocol(shipped_protocol("study-one"))
    steps = steps_of(protocol, ["warm-start", "policy-3", "policy-1", "policy-2"])
    assert protocol.people == 16
    assert [(s.id, s.seconds) for s in steps if s.kind == "baseline"] == [
        ("baseline-resting", 180.0),
        ("baseline-walking", 60.0),
    ]
    assert [s.seconds for s in steps if s.kind == "explore"] == [300.0]
    warm_up = [s for s in steps if s.kind == "warm_up"]
    assert len(warm_up) == 2
    assert all(s.speed < 1.0 and not s.is_recorded for s in warm_up)
    games = [s for s in steps if s.kind == "game"]
    assert [(s.section, s.game) for s in games] == [
        (a, b) for a in range(1, 5) for b in range(1, 6)
    ]
    assert {s.seconds for s in games} == {20.0}
    assert [s.player for s in games[::5]] == ["warm-start", "style-3", "style-1", "style-2"]
    assert all(s.is_recorded and s.speed == 1.0 for s in games)
    assert [s.seconds for s in steps if s.kind == "rest"] == [30.0] * 16
    asked = [s.id for s in steps if s.kind in ("questionnaire", "ranking")]
    assert asked == [
        "q-about-you", "s1-q-adjectives", "s2-q-adjectives", "s2-r-comparison", "s3-q-adjectives",
        "s3-r-comparison", "s4-q-adjectives", "s4-r-comparison", "q-tam", "q-improvement",
    ]  # fmt: skip
    assert protocol.order.first == ("warm-start",)
    adjectives = protocol.instrument_named("adjectives").item[0]
    assert adjectives.is_several
    assert len(adjectives.options) == 10
    assert adjectives.other.startswith("Others")


def test_study_two_is_the_papers():
    protocol = load_protocol(shipped_protocol("study-two"))
    steps = steps_of(protocol, ["rl", "baseline"])
    assert protocol.people == 10
    games = [s for s in steps if s.kind == "game"]
    assert [(s.section, s.game) for s in games] == [(a, b) for a in (1, 2) for b in range(1, 11)]
    assert [s.player for s in games[::10]] == ["style-1", "scripted:heuristic"]
    assert [s.seconds for s in steps if s.kind == "rest"] == [15.0] * 18
    asked = [s.id for s in steps if s.kind == "questionnaire"]
    assert asked == ["q-about-you", "s1-q-tam", "s2-q-tam", "q-which-robot"]
    assert not protocol.order.first


def test_both_studies_ask_the_same_seven_questions_on_five_points():
    one, two = (load_protocol(shipped_protocol(n)) for n in ("study-one", "study-two"))
    tam = one.instrument_named("tam")
    assert tam == two.instrument_named("tam")
    assert [i.construct for i in tam.item] == ["PU", "PEOU", "ATT", "ITU", "PENJ", "DE", "IE"]
    assert {i.scale for i in tam.item} == {5}
    assert (tam.labels[0], tam.labels[2], tam.labels[4]) == (
        "Strongly Disagree", "Neutral", "Strongly Agree",
    )  # fmt: skip


WRONG = {
    "an unknown field": ("games = 5", "gamez = 5", "section[1].gamez", "'games'"),
    "a wrong type": ("rest = 30.0", 'rest = "x"', "section[1].rest", "float"),
    "an impossible value": ("speed = 0.5", "speed = 7.0", "warm_up.speed", "0.05 to 1"),
    "a condition that is not there": (
        'first = ["warm-start"]', 'first = ["warmstart"]', "order.first", "'warm-start'",
    ),
    "an instrument that is not there": (
        'instruments = ["tam", "improvement"]', 'instruments = ["tan"]', "end.instruments", "'tam'",
    ),
    "a scale that is none": (
        'scale = "ranking"', 'scale = "rank"', "instrument[3].item[1].scale", "'ranking'",
    ),
    "an item twice": ('id = "PEOU"', 'id = "PU"', "instrument[4].item[2].id", "twice"),
    "a name that is none": ('id = "PEOU"', 'id = "P U"', "instrument[4].item[2].id", "letters"),
    "a ranking of one section": (
        'instruments = ["adjectives"]', 'instruments = ["comparison"]', "section[1].instruments",
        "after the second section",
    ),
    "scales of two lengths in one instrument": (
        'id = "PEOU"', 'id = "PEOU"\nscale = 7', "instrument[4].item[2].scale",
        "'PEOU' has 7 points, and the first of 'tam' 5",
    ),
    "a label too few": ('"Neutral", ', "", "instrument[4].labels", "5 points"),
    "reversed choices": (
        "is_several = true", "is_reversed = true", "instrument[2].item[1].is_reversed", "choices",
    ),
    "half an hour as a game": ("seconds = 20.0", "seconds = 1800", "game.seconds", "600"),
    "a table of nothing known": ("[explore]", "[explorer]", "explorer", "'explore'"),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_what_is_wrong_is_named_with_its_line_and_its_field(what):
    old, new, field, expected = WRONG[what]
    assert old in ONE
    text = ONE.replace(old, new, 1)
    with pytest.raises(ConfigError) as refused:
        read_protocol(text.encode(), "mine.toml")
    said = re.fullmatch(r"mine\.toml:(\d+): (\S+): (.*)", str(refused.value))
    assert said is not None, str(refused.value)
    line = text.splitlines()[int(said[1]) - 1]
    assert said[2] == field
    assert line in new.splitlines() or field.split(".")[-1] in line
    assert expected in said[3]


def test_a_protocol_with_a_section_too_few_is_refused():
    text = ONE.replace('[[section]]\ngames = 5\nrest = 30.0\ninstruments = ["adjectives"]\n', "", 1)
    with pytest.raises(ConfigError, match="3 sections and 4 conditions"):
        read_protocol(text.encode(), "mine.toml")


def test_a_missing_field_is_named():
    with pytest.raises(ConfigError, match="people is missing"):
        read_protocol(ONE.replace("people = 16\n", "").encode(), "mine.toml")


def test_an_order_that_lacks_a_condition_is_refused():
    with pytest.raises(ValueError, match="each condition once"):
        steps_of(load_protocol(shipped_protocol("study-two")), ["rl", "rl"])
