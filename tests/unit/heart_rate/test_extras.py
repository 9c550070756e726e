"""Heart rate and tones beside the loop: ticked, shown, closed, and never a reason to stop."""

import msgspec

from services.robot_io.config import RobotIoConfig
from services.robot_io.extras import Extras
from services.robot_io.heart_rate.source import HeartRateConfig, open_heart_rate
from services.robot_io.service import RobotIo
from shared.messages.topics import HEART_RATE
from tests.unit.robot_io.looping import Looping


class Extra:
    """One that remembers what was done to it."""

    def __init__(self, name: str, problem: str = "") -> None:
        self.name = name
        self.problem = problem
        self.ticks = 0
        self.is_closed = False

    def tick(self, now: float) -> None:
        self.ticks += 1

    def rates(self) -> dict[str, float]:
        return {f"{self.name}_hz": 1.5}

    def counters(self) -> dict[str, int]:
        return {f"{self.name}_count": self.ticks}

    def close(self) -> None:
        self.is_closed = True


def beside(it: Looping, *extras: Extra) -> None:
    """Put extras beside the loop of a bench."""
    it.service.close()
    parts = msgspec.structs.replace(it.parts, extras=Extras(extras))
    it.service = RobotIo(RobotIoConfig(), parts, 0.01, it.bus, it.clock)


def test_extras_are_ticked_shown_and_closed():
    it = Looping()
    one, two = Extra("one"), Extra("two", problem="two: no device; plug it in")
    beside(it, one, two)
    it.tick(5)
    health = it.service.health()
    assert one.ticks == two.ticks >= 5
    assert health.rates["one_hz"] == health.rates["two_hz"] == 1.5
    assert health.counters["two_count"] == two.ticks
    assert health.last_error == "two: no device; plug it in"
    it.service.close()
    assert one.is_closed
    assert two.is_closed


def test_trouble_beside_the_loop_does_not_touch_the_gate():
    it = Looping()
    beside(it, Extra("strap", problem="heart rate: no measurement for 60 s"))
    it.tick(3)
    assert it.ask("arm").accepted
    it.tick(3)
    assert it.seen[-1].mode == "ramping"
    assert it.service.health().last_error == "heart rate: no measurement for 60 s"
    assert it.service.health().waiting_for == ""


def test_a_trip_is_shown_before_the_trouble_of_an_extra():
    it = Looping()
    beside(it, Extra("strap", problem="heart rate: no measurement for 60 s"))
    it.tick(3)
    assert it.ask("arm").accepted
    it.offset = None
    it.tick(60)
    assert it.seen[-1].mode == "tripped"
    assert it.service.health().last_error == it.seen[-1].reason != ""


def test_the_loop_publishes_a_recorded_heart_rate(tmp_path):
    path = tmp_path / "hr.csv"
    path.write_text("seconds,beats_per_minute\n0,60\n0.5,61\n")
    it = Looping()
    heard = it.bench.subscribe(HEART_RATE)
    feed = open_heart_rate(HeartRateConfig(source="replay", file=str(path)), it.bus, it.clock)
    assert feed is not None
    parts = msgspec.structs.replace(it.parts, extras=Extras((feed,)))
    it.service = RobotIo(RobotIoConfig(), parts, 0.01, it.bus, it.clock)
    it.tick(60)
    said = [heard.take(), heard.take(), heard.take()]
    assert [beat and beat.beats_per_minute for beat in said] == [60.0, 61.0, None]
    health = it.service.health()
    assert health.rates["heart_rate_bpm"] == 61.0
    assert health.counters["heart_rate_measurements"] == 2
