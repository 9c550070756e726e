"""From the referee's word to the sink, and the settings."""

import re

import numpy as np
import pytest

from services.robot_io.tones.tones import Tones, TonesConfig, open_tones
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.play import RefereeState
from shared.messages.topics import REFEREE


class Sink:
    """A sink that remembers."""

    problem = ""

    def __init__(self) -> None:
        self.played: list[float] = []
        self.is_closed = False

    def play(self, hz: float) -> None:
        self.played.append(hz)

    def rates(self) -> dict[str, float]:
        return {"tone_latency_ms": 12.0}

    def counters(self) -> dict[str, int]:
        return {"tone_underruns": 2}

    def close(self) -> None:
        self.is_closed = True


def saying(hz: float, step: int = 0) -> RefereeState:
    return RefereeState(
        bout="b", phase="running", antagonist="a", protagonist="p", tick=step, step=step,
        seconds=0.0, score=0.0, points=0.0, in_target=np.zeros(2, bool), contact=False,
        attack_steps=0, penalty_steps=0, camping_steps=0, missed_ticks=0, tone_hz=hz,
    )  # fmt: skip


class Sounding:
    def __init__(self) -> None:
        self.clock = ManualClock(20.0)
        hub = MemoryHub(self.clock)
        self.referee = hub.join("referee-0")
        self.sink = Sink()
        self.tones = Tones(self.sink, 0.25, hub.join("robot-io-0"))

    def say(self, hz: float) -> None:
        self.referee.publish(REFEREE, saying(hz, len(self.sink.played)))
        self.tones.tick(self.clock.now())

    def pass_time(self, seconds: float) -> None:
        self.clock.advance(seconds)
        self.tones.tick(self.clock.now())


def test_the_sink_hears_each_change_once():
    it = Sounding()
    for hz in (0.0, 440.0, 440.0, 300.0, 300.0, 440.0, 0.0, 0.0):
        it.say(hz)
        it.pass_time(0.01)
    assert it.sink.played == [440.0, 300.0, 440.0, 0.0]
    assert it.tones.counters() == {
        "tone_switches": 4, "tones_cut": 0, "tones_refused": 0, "tone_underruns": 2,
    }  # fmt: skip


def test_a_tone_that_goes_on_is_said_again_and_silence_is_not():
    it = Sounding()
    for _ in range(20):
        it.say(440.0)
        it.pass_time(0.02)
    assert it.sink.played == [440.0] * 4
    for _ in range(20):
        it.say(0.0)
        it.pass_time(0.02)
    assert it.sink.played == [440.0] * 4 + [0.0]
    assert it.tones.counters()["tone_switches"] == 2


def test_a_tone_ends_when_the_referee_falls_silent():
    it = Sounding()
    it.say(440.0)
    assert it.tones.rates() == {"tone_hz": 440.0, "tone_latency_ms": 12.0}
    it.pass_time(0.05)
    assert it.sink.played == [440.0]
    it.pass_time(0.19)
    assert it.sink.played == [440.0, 440.0]
    it.pass_time(0.02)
    it.pass_time(1.0)
    assert it.sink.played == [440.0, 440.0, 0.0]
    assert it.tones.counters()["tones_cut"] == 1
    it.say(300.0)
    assert it.sink.played == [440.0, 440.0, 0.0, 300.0]


@pytest.mark.parametrize("hz", [float("nan"), float("inf"), -440.0, 1.0, 90000.0])
def test_what_is_no_tone_is_silence(hz: float):
    it = Sounding()
    it.say(440.0)
    it.say(hz)
    assert it.sink.played == [440.0, 0.0]
    assert it.tones.counters()["tones_refused"] == 1


def test_closing_falls_silent_first():
    it = Sounding()
    it.say(440.0)
    it.tones.close()
    assert it.sink.played == [440.0, 0.0]
    assert it.sink.is_closed


def test_silence_is_the_default():
    clock = ManualClock()
    assert open_tones(TonesConfig(), MemoryHub(clock).join("x")) is None


@pytest.mark.parametrize(
    ("settings", "expected"),
    [
        ({"volume": 1.1}, "volume is 1.1; allowed are 0 to 1"),
        ({"volume": float("nan")}, "volume is nan; allowed are 0 to 1"),
        ({"latency": 0.001}, "latency is 0.001; allowed are 0.005 to 0.16"),
        ({"silence_after": 0.0}, "silence_after is 0; allowed are 0.05 to 5"),
        ({"retry": 0.0}, "retry is 0; allowed are 0.1 to 600"),
        ({"device": "USB"}, "device is 'USB' and sink is 'null'"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict, expected: str):
    with pytest.raises(ValueError, match=re.escape(expected)):
        TonesConfig(**settings)
