"""Heart rates of a study: which rows make a baseline, a peak and a level."""

import msgspec
import pytest

from shared.study.analysis.chapters.heart_rate import beats_of
from shared.study.analysis.games import games_of
from shared.study.instants import text_of
from shared.study.protocol_file import load_protocol, shipped_protocol
from shared.study.rows import GameRow, HeartRateRow, ParticipantRow
from shared.study.tables import tables_of
from tests.unit.study_analysis.made import BEGIN_NS

PERSON = ParticipantRow(
    participant="sub-01", session=1, order="A,B", state="ended", games=1, t_ns=0,
    wall=text_of(BEGIN_NS), wall_ended=text_of(BEGIN_NS), protocol="", config="",
)  # fmt: skip
GAME = GameRow(
    participant="sub-01", session=1, section=1, condition="A", game=1, attempt=2,
    outcome="finished", is_recorded=True, score=10.0, t_ns=0, wall=text_of(BEGIN_NS), bout="b",
    policy="", config="",
)  # fmt: skip


def beat(second, bpm, step, game=0, attempt=0, contact=True):
    return HeartRateRow(
        participant="sub-01", session=1, t_ns=0, wall=text_of(BEGIN_NS + round(second * 1e9)),
        bpm=bpm, contact=contact, step=step, section=1 if game else 0,
        condition="A" if game else "", game=game, attempt=attempt, source="strap", policy="",
        config="",
    )  # fmt: skip


def beats(rows):
    protocol = load_protocol(shipped_protocol("study-two"))
    void = msgspec.structs.replace(GAME, attempt=1, outcome="void", score=None)
    tables = tables_of(protocol, [PERSON], games=[void, GAME], heart_rate=rows)
    return beats_of(tables, games_of(tables))


def test_a_baseline_that_was_begun_again_is_its_last_stretch():
    rows = [beat(0.0, 120.0, "baseline-walking"), beat(300.0, 90.0, "baseline-walking")]
    rows.append(beat(359.0, 92.0, "baseline-walking"))  # a minute, as the protocol says
    assert beats(rows).walking[0] == pytest.approx(91.0)


def test_a_peak_is_of_the_attempt_that_counts_and_of_a_sensor_that_touches():
    rows = [beat(0.0, 100.0, "baseline-walking")]
    rows += [beat(1.0, 180.0, "s1-g01", 1, 1), beat(2.0, 190.0, "s1-g01", 1, 2, contact=False)]
    rows += [beat(3.0, 110.0, "s1-g01", 1, 2), beat(4.0, 130.0, "s1-g01", 1, 2)]
    found = beats(rows)
    assert found.peaks[0, 0, 0] == 130.0
    assert found.levels[0, 0] == pytest.approx(1.3)
    assert "1 heart rate left out: no contact to the skin, or not above zero" in found.left_out
    assert "1 person left out: no resting baseline" in found.left_out
