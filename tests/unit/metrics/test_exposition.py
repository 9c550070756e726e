"""The text as Prometheus' own reader reads it."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st
from prometheus_client.parser import text_string_to_metric_families

from services.metrics.exposition import Family, Sample, render

TEMPERATURE = Family("room_temperature_celsius", "gauge", "Of the air (°C).")
VISITS = Family("visits_total", "counter", "Since the doors opened.")


def read(page: bytes) -> dict[tuple[str, tuple[tuple[str, str], ...]], float]:
    return {
        (sample.name, tuple(sorted(sample.labels.items()))): sample.value
        for family in text_string_to_metric_families(page.decode())
        for sample in family.samples
    }


def test_families_come_in_order_with_their_help_and_type():
    samples = [Sample(VISITS, {}, 3), Sample(TEMPERATURE, {"room": "a"}, 20.5)]
    assert render((TEMPERATURE, VISITS), samples).decode().splitlines() == [
        "# HELP room_temperature_celsius Of the air (°C).",
        "# TYPE room_temperature_celsius gauge",
        'room_temperature_celsius{room="a"} 20.5',
        "# HELP visits_total Since the doors opened.",
        "# TYPE visits_total counter",
        "visits_total 3.0",
    ]


def test_a_family_without_samples_is_left_out():
    assert render((TEMPERATURE, VISITS), []) == b""


@settings(deadline=None)
@given(
    st.text(st.characters(exclude_categories=["Cs", "Cc"], include_characters='\n"\\')),
    st.floats(allow_nan=False, allow_infinity=False),
)
def test_any_label_and_any_number_are_read_back(text: str, value: float):
    page = render((TEMPERATURE,), [Sample(TEMPERATURE, {"room": text}, value)])
    assert read(page) == {("room_temperature_celsius", (("room", text),)): value}


def test_half_a_character_does_not_break_the_page():
    page = render((TEMPERATURE,), [Sample(TEMPERATURE, {"room": "\ud800"}, 1.0)])
    assert math.isclose(next(iter(read(page).values())), 1.0)
