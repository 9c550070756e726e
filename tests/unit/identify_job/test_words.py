"""Numbers with units, and the lines at the end."""

from pathlib import Path

import msgspec
import pytest

from services.jobs.identify.words import (
    cause_text,
    held_out_text,
    limit_text,
    moment_text,
    number_text,
    quantity_text,
    share_text,
    unexplained_mark,
    unexplained_text,
    verdict_text,
)
from shared.identification.conclusion.sentence import as_told, sentence_of
from shared.identification.verdict import Cause, Interval, Limit
from tests.unit.identify_job.examples import WORDS, example


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.0304, "s", "30.4 ms"),
        (0.3, "s", "0.3 s"),
        (-0.0021, "m", "\N{MINUS SIGN}2.1 mm"),
        (0.05, "rad", "50 mrad"),
        (0.612, "N m", "0.612 N m"),
        (0.25, "1", "25 %"),
        (0.034, "kg", "34 g"),
        (0.00028, "rad/(N m)", "0.28 mrad/(N m)"),
        (0.5, "rad/(N m)", "0.5 rad/(N m)"),
        (2.17, "", "2.17"),
        (0.00012, "kg m^2", "0.00012 kg m^2"),
        (0.0, "s", "0 s"),
    ],
)
def test_a_quantity_is_written_in_a_unit_that_fits(value: float, unit: str, text: str) -> None:
    assert quantity_text(value, unit) == text


def test_an_interval_has_the_unit_of_its_value() -> None:
    ends = Interval(low=0.09, high=0.12)
    assert quantity_text(0.099, "s", ends) == "0.099 s (0.09 to 0.12)"
    assert quantity_text(0.02, "s", Interval(low=-0.001, high=0.04)) == (
        "20 ms (\N{MINUS SIGN}1 to 40)"
    )


def _limited(low: float) -> Cause:
    return Cause(
        effect="torque_saturation", where="elbow", quantity="inverse_limit", value=0.25,
        unit="1/(N m)", interval=Interval(low=low, high=0.5), title="weak", signature="",
    )  # fmt: skip


def test_a_limit_sought_as_one_over_it_is_told_as_a_limit() -> None:
    assert cause_text(_limited(0.2)) == "weak at elbow: limit 4 N m (2 to 5)"
    assert cause_text(_limited(-0.01)) == "weak at elbow: limit 4 N m (2 to \N{INFINITY})"
    held_out = example("named").verdict.held_out
    told = [sentence_of("named", (_limited(low),), (), held_out, ()) for low in (0.2, -0.01)]
    assert "weak at elbow (limit 4 ± 2 N m)." in told[0]
    assert "weak at elbow (limit 4 N m, at least 2)." in told[1]


@pytest.mark.parametrize(
    ("quantity", "size", "unit", "text"),
    [
        ("mass", 0.034, "kg", "mass from 34 g"),
        ("half_difference", 0.0671, "N m s/rad", "half difference from 0.067 N m s/rad"),
        ("inverse_limit", 0.25, "1/(N m)", "limit up to 4 N m"),
        ("cosine", 0.2, "N m", "amplitude from 0.2 N m"),
        ("share", None, "1", "at no size"),
    ],
)
def test_a_limit_of_detection_is_told_as_its_cause_would_be(
    quantity: str, size: float | None, unit: str, text: str
) -> None:
    limit = Limit(effect="e", title="t", where="elbow", quantity=quantity, size=size, unit=unit)
    assert limit_text(limit) == text


def test_where_nothing_is_named_the_screen_says_what_would_have_been() -> None:
    none = example("none").verdict
    told = " ".join(verdict_text(none, Path("out")).split())
    assert "would show payload (mass from 34 g); of each joint in the report" in told
    assert "would show" not in verdict_text(example("named").verdict, Path("out"))


def test_a_ripple_is_told_by_its_amplitude() -> None:
    ripple = Cause(
        effect="cogging", where="elbow", quantity="cosine", value=0.0, unit="N m",
        interval=Interval(low=-0.01, high=0.01), others={"sine": -0.2, "ripples": 12.0},
        title="it ripples", signature="",
    )  # fmt: skip
    assert cause_text(ripple) == "it ripples at elbow: amplitude 0.2 N m (0.19 to 0.21)"


def test_a_slip_is_told_by_its_length_and_since_when() -> None:
    slip = Cause(
        effect="tracker_slip", where="sweep", quantity="x", value=0.0003, unit="m",
        interval=Interval(low=-0.0001, high=0.0007), others={"y": 0.0, "z": -0.0004, "time": 3.5},
        other_units={"y": "m", "z": "m", "time": "s"}, title="it slipped", signature="",
        other_intervals={
            "y": Interval(low=-0.0004, high=0.0004), "z": Interval(low=-0.0008, high=0.0)
        },
    )  # fmt: skip
    assert cause_text(slip) == "it slipped at sweep: distance 0.5 mm (0.1 to 0.9)"
    told = as_told(slip)
    assert (told.others["x"], told.other_units["x"]) == (0.0003, "m")
    assert told.other_intervals["x"] == slip.interval
    sentence = sentence_of("named", (slip,), (), example("named").verdict.held_out, ())
    assert "it slipped at sweep (distance 0.5 ± 0.4 mm, from 3.50 s on)." in sentence


def test_a_push_is_told_with_its_time() -> None:
    push = Cause(
        effect="external_contact", where="elbow in sweep", quantity="torque", value=-200.0,
        unit="N m", interval=Interval(low=-220.0, high=-180.0), title="it pushed", signature="",
        others={"begin": 1.25, "length": 0.5}, other_units={"begin": "s", "length": "s"},
    )  # fmt: skip
    sentence = sentence_of("named", (push,), (), example("named").verdict.held_out, ())
    assert "(torque -200 ± 20 N m, from 1.25 to 1.75 s)." in sentence


def test_a_cause_is_told_by_the_number_that_is_most_surely_not_nothing() -> None:
    tilt = Cause(
        effect="gravity_tilt", where="", quantity="x", value=0.004, unit="rad",
        interval=Interval(low=-0.016, high=0.024), others={"y": -0.03, "z": 0.01, "falloff": 2.0},
        other_units={"y": "rad", "z": "m"}, title="it leans", signature="",
        other_intervals={"y": Interval(low=-0.04, high=-0.02), "z": Interval(low=0.001, high=0.02)},
    )  # fmt: skip
    told = as_told(tilt)
    minus = "\N{MINUS SIGN}"
    assert cause_text(tilt) == f"it leans: y {minus}30 mrad ({minus}40 to {minus}20)"
    assert told.others == {"x": 0.004, "z": 0.01, "falloff": 2.0}
    assert told.other_intervals["x"] == tilt.interval
    sure = msgspec.structs.replace(tilt, interval=Interval(low=0.001, high=0.007))
    alone = msgspec.structs.replace(tilt, other_intervals={"z": Interval(low=-1.0, high=1.0)})
    assert [as_told(sure), as_told(alone)] == [sure, alone]


@pytest.mark.parametrize(
    ("value", "text"),
    [(1234567.0, "1,234,567"), (0.00001234, "0.0000123"), (float("nan"), "not known"), (7.0, "7")],
)
def test_numbers_have_no_powers_of_ten(value: float, text: str) -> None:
    assert number_text(value) == text


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0000576, "0"),
        (-0.0000576, "0"),
        (0.3666, "0.37"),
        (16.0, "16"),
        (1234.567, "1234.57"),
        (-0.25, "\N{MINUS SIGN}0.25"),
    ],
)
def test_moments_are_told_to_a_hundredth_of_a_second(seconds: float, text: str) -> None:
    assert moment_text(seconds) == text


def test_shares_are_in_percent() -> None:
    assert share_text(0.987, Interval(low=0.95, high=1.0)) == "99 % (95 to 100)"
    assert share_text(-0.02) == "\N{MINUS SIGN}2 %"


def test_places_have_letters_then_numbers() -> None:
    assert [unexplained_mark(k) for k in (0, 25, 26)] == ["A", "Z", "27"]


def test_a_floor_that_nothing_measured_is_not_called_the_noise() -> None:
    measured = example("none").verdict.held_out
    guessed = msgspec.structs.replace(measured, is_floor_measured=False)
    assert "1 is the noise floor" in held_out_text(measured)
    assert "noise floor" not in held_out_text(guessed)
    assert "1 is what the base fit usually leaves" in held_out_text(guessed)
    left = example("unexplained").verdict.unexplained[0]
    assert unexplained_text(left, measured).endswith("times the noise floor")
    assert unexplained_text(left, guessed).endswith("times what the base fit usually leaves")


def test_what_came_from_outside_is_called_external() -> None:
    verdict = example("unexplained").verdict
    left = verdict.unexplained[0]
    pushed = msgspec.structs.replace(left, is_external=True)
    assert "external" not in unexplained_text(left, verdict.held_out)
    assert "7.7 to 8.7 s, external, once:" in unexplained_text(pushed, verdict.held_out)


def test_pushes_are_told_where_there_is_nothing_to_name_with_the_joints_they_were_at() -> None:
    verdict = example("unexplained").verdict
    one = msgspec.structs.replace(
        verdict.unexplained[0], is_external=True, where="elbow", torque=0.22, torque_unit="N m"
    )
    other = msgspec.structs.replace(one, where="pan", torque=0.1)
    told = sentence_of("none", (), (), verdict.held_out, (one,))
    assert told.startswith("Nothing to name")
    assert "Something outside pushed elbow once, from" in told
    told = sentence_of("none", (), (), verdict.held_out, (one, other))
    assert "pushed elbow and pan 2 times, most from" in told
    assert told.endswith("with 0.22 N m at elbow.")


@pytest.mark.parametrize("word", WORDS)
def test_the_last_lines_say_the_verdict_and_where_the_report_is(word: str) -> None:
    verdict = example(word).verdict  # pyright: ignore[reportArgumentType]
    text = verdict_text(verdict, Path("out"))
    flat = " ".join(text.split())
    assert verdict.sentence in flat
    assert "out/report.html" in flat
    is_warned = bool(verdict.caveats) or not verdict.starts_agree
    assert flat.count("beware") == is_warned
    for cause in (*verdict.causes, *(each for tie in verdict.ties for each in tie.causes)):
        assert quantity_text(cause.value, cause.unit, cause.interval) in flat
    for sentence in verdict.record_next:
        assert sentence in flat
    assert max(len(line) for line in text.splitlines()) <= 88


@pytest.mark.parametrize(("count", "more"), [(1, ""), (2, ""), (4, "and 2 more, in the report")])
def test_what_a_verdict_is_worth_less_for_is_told_on_the_screen(count: int, more: str) -> None:
    caveats = tuple(f"reason {number}" for number in range(count))
    verdict = msgspec.structs.replace(example("named").verdict, caveats=caveats)
    verdict = msgspec.structs.replace(verdict, starts_agree=True)
    told = verdict_text(verdict, Path("out")).partition("beware")[2].splitlines()
    said = [f"reason {number}" for number in range(min(count, 2))] + [more] * bool(more)
    assert [line.strip() for line in told[: len(said)]] == said
    doubted = msgspec.structs.replace(verdict, starts_agree=False)
    assert "did not meet" in verdict_text(doubted, Path("out")).partition("beware")[2]


@pytest.mark.parametrize(("count", "more"), [(2, ""), (3, ""), (5, "and 2 more, in the report")])
def test_what_is_left_and_not_listed_is_counted(count: int, more: str) -> None:
    verdict = example("unexplained").verdict
    left = tuple(
        msgspec.structs.replace(verdict.unexplained[0], begin=float(index), end=index + 0.5)
        for index in range(count)
    )
    text = verdict_text(msgspec.structs.replace(verdict, unexplained=left), Path("out"))
    assert text.count(" times ") >= min(count, 3)
    assert ("more, in the report" in text) == bool(more)
    assert more in text
