"""The feed: what is published, gaps, and recordings; its settings."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from structlog.testing import capture_logs

from services.robot_io.heart_rate.replay import HeartRateReplay
from services.robot_io.heart_rate.source import (
    Beat,
    HeartRateConfig,
    HeartRateFeed,
    open_heart_rate,
)
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.errors import ConfigError
from shared.messages.play import HeartRate
from shared.messages.topics import HEART_RATE


class Source:
    """Beats that a test says."""

    name = "strap"
    problem = ""

    def __init__(self) -> None:
        self.beats: list[Beat] = []
        self.is_closed = False

    def take(self, now: float) -> Beat | None:
        return self.beats.pop(0) if self.beats else None

    def counters(self) -> dict[str, int]:
        return {"heart_rate_connects": 3}

    def close(self) -> None:
        self.is_closed = True


class Feeding:
    def __init__(self) -> None:
        self.clock = ManualClock(100.0)
        hub = MemoryHub(self.clock)
        self.heard = hub.join("bench").subscribe(HEART_RATE)
        self.source = Source()
        self.feed = HeartRateFeed(self.source, 5.0, hub.join("robot-io-0"))

    def beat(self, bpm: float, rr_ms: tuple[float, ...] = (), contact: bool = True) -> None:
        now = self.clock.now()
        beat = Beat(at=now, at_ns=7, beats_per_minute=bpm, rr_ms=rr_ms, contact=contact)
        self.source.beats.append(beat)
        self.feed.tick(now)

    def pass_time(self, seconds: float) -> None:
        self.clock.advance(seconds)
        self.feed.tick(self.clock.now())


def test_a_measurement_is_published_as_it_came():
    it = Feeding()
    it.feed.tick(it.clock.now())
    assert it.feed.rates() == {}
    it.beat(91.0, (640.0, 660.0), contact=False)
    assert it.heard.take() == HeartRate(
        at_ns=7, beats_per_minute=91.0, rr_ms=(640.0, 660.0), contact=False, source="strap"
    )
    assert it.feed.rates() == {"heart_rate_bpm": 91.0, "heart_rate_age_s": 0.0}
    assert it.feed.counters()["heart_rate_connects"] == 3
    it.feed.close()
    assert it.source.is_closed


def test_what_is_no_heart_rate_is_counted_and_not_published():
    it = Feeding()
    for bpm in (0.0, 19.0, 301.0, 65535.0, float("nan"), float("inf")):
        it.beat(bpm)
    assert it.heard.take() is None
    assert it.feed.counters()["heart_rate_unusable"] == 6
    assert it.feed.counters()["heart_rate_measurements"] == 0


def test_intervals_that_no_heart_makes_are_left_out():
    it = Feeding()
    it.beat(60.0, (0.0, 149.0, 1000.0, 3501.0, 64000.0))
    said = it.heard.take()
    assert said is not None
    assert said.rr_ms == (1000.0,)


def test_five_seconds_without_a_measurement_are_a_gap_counted_once():
    it = Feeding()
    it.beat(80.0)
    with capture_logs() as logs:
        it.pass_time(5.0)
        assert it.feed.problem == ""
        it.pass_time(0.5)
        it.pass_time(1.0)
        assert it.feed.problem == "heart rate: no measurement for 6 s; look at the strap"
        assert it.feed.rates() == {"heart_rate_age_s": pytest.approx(6.5)}
        it.clock.advance(1.5)
        it.beat(81.0)
    assert [(line["event"], line["seconds"]) for line in logs] == [
        ("heart_rate_gap_began", 5.5),
        ("heart_rate_gap_ended", 8.0),
    ]
    assert it.feed.counters()["heart_rate_gaps"] == 1
    assert it.feed.problem == ""


def test_unusable_measurements_do_not_hide_a_gap():
    it = Feeding()
    it.beat(80.0)
    for _ in range(6):
        it.clock.advance(1.0)
        it.beat(0.0)
    assert it.feed.counters()["heart_rate_gaps"] == 1


def test_a_flood_of_measurements_is_taken_in_parts():
    it = Feeding()
    now = it.clock.now()
    it.source.beats = [Beat(at=now, at_ns=1, beats_per_minute=70.0)] * 100
    it.feed.tick(now)
    assert len(it.source.beats) == 84


def replayed(path: Path, seconds: float) -> list[tuple[float, HeartRate]]:
    """Play a recording for so long; return what was published, and when."""
    clock = ManualClock(10.0)
    hub = MemoryHub(clock)
    heard = hub.join("bench").subscribe(HEART_RATE)
    cfg = HeartRateConfig(source="replay", file=str(path))
    feed = open_heart_rate(cfg, hub.join("robot-io-0"), clock)
    assert feed is not None
    said: list[tuple[float, HeartRate]] = []
    while clock.now() < 10.0 + seconds:
        feed.tick(clock.now())
        while (beat := heard.take()) is not None:
            said.append((round(clock.now() - 10.0, 2), beat))
        clock.advance(0.1)
    return said


def test_a_recorded_table_comes_at_its_own_times_over_and_over(tmp_path: Path):
    path = tmp_path / "hr.tsv"
    path.write_text(
        "seconds\tbeats_per_minute\trr_ms\n3.0\t60\t1000 990\n4.0\t61.5\t\n5.5\t62\t970\n"
    )
    said = replayed(path, 5.0)
    assert [at for at, _ in said] == [0.0, 1.0, 2.5, 3.5, 4.5]
    assert [beat.beats_per_minute for _, beat in said] == [60.0, 61.5, 62.0, 60.0, 61.5]
    assert [beat.rr_ms for _, beat in said[:3]] == [(1000.0, 990.0), (), (970.0,)]
    assert said[0][1].source == "hr.tsv"


def test_a_recorded_array_comes_too(tmp_path: Path):
    path = tmp_path / "hr.npy"
    np.save(path, np.array([[0.0, 70.0], [1.0, 71.0]]))
    assert [beat.beats_per_minute for _, beat in replayed(path, 1.5)] == [70.0, 71.0]


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("a.csv", "", "no column 'seconds' in its first line"),
        ("a.csv", "seconds,bpm\n1,2\n", "no column 'beats_per_minute' in its first line"),
        ("a.csv", "seconds,beats_per_minute\n", r"shape \(0, 2\), expected \[T, 2\]"),
        ("a.csv", "seconds,beats_per_minute\n1,x\n", "could not convert string to float: 'x'"),
        ("a.csv", "seconds,beats_per_minute\n1\n", "None is not a number"),
        ("a.csv", "seconds,beats_per_minute\n1,nan\n", "'nan' is not a number"),
        ("a.csv", "seconds,beats_per_minute\n2,60\n2,60\n", "times that do not rise"),
        ("a.csv", "seconds,beats_per_minute,rr_ms\n2,60,a b\n", "could not convert string"),
        ("a.npy", "no array", "cannot read the recorded heart rate"),
    ],
)
def test_a_file_that_is_no_recording_is_refused_in_one_line(
    tmp_path: Path, name: str, text: str, expected: str
):
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(ConfigError, match=expected) as error:
        HeartRateReplay.load(path, ManualClock())
    assert "\n" not in str(error.value)


def test_arrays_that_are_no_recording_are_refused(tmp_path: Path):
    path = tmp_path / "a.npy"
    np.save(path, np.zeros((3, 3)))
    with pytest.raises(ConfigError, match=r"shape \(3, 3\), expected \[T, 2\]"):
        HeartRateReplay.load(path, ManualClock())
    np.save(path, np.array([[0.0, np.nan]]))
    with pytest.raises(ConfigError, match="not finite"):
        HeartRateReplay.load(path, ManualClock())
    np.save(path, np.array([object()]), allow_pickle=True)
    with pytest.raises(ConfigError, match="it holds object"):
        HeartRateReplay.load(path, ManualClock())
    with pytest.raises(ConfigError, match="No such file"):
        HeartRateReplay.load(tmp_path / "none.csv", ManualClock())


def test_no_heart_rate_is_the_default():
    clock = ManualClock()
    assert open_heart_rate(HeartRateConfig(), MemoryHub(clock).join("x"), clock) is None


def test_a_strap_without_its_library_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delitem(sys.modules, "services.robot_io.heart_rate.ble", raising=False)
    monkeypatch.setitem(sys.modules, "bleak", None)
    clock = ManualClock()
    with pytest.raises(ConfigError, match=r"needs bleak .*: `pip install riposte\[robot\]`"):
        open_heart_rate(HeartRateConfig(source="ble"), MemoryHub(clock).join("x"), clock)


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"stale_after": 0.5}, "stale_after is 0.5; allowed are 1 to 60"),
        ({"silent_after": float("nan")}, "silent_after is nan; allowed are 1 to 600"),
        ({"search_seconds": 0.0}, "search_seconds is 0; allowed are 0.5 to 120"),
        ({"retry_first": 0.0}, "retry_first is 0; allowed are 0.05 to 60"),
        ({"retry_longest": 601.0}, "retry_longest is 601; allowed are 0.05 to 600"),
        ({"retry_first": 40.0}, "retry_first (40) must not be above retry_longest (30)"),
        ({"source": "replay"}, "source is 'replay' and file is ''"),
        ({"file": "x.csv"}, "source is 'none' and file is 'x.csv'"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict, expected: str):
    with pytest.raises(ValueError, match=re.escape(expected)):
        HeartRateConfig(**settings)
