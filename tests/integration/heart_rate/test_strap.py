"""A strap under the real bleak: found, heard, dropped, found again; and what is not there."""

import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from services.robot_io.heart_rate.ble import BleStrap
from services.robot_io.heart_rate.source import Beat, HeartRateConfig
from shared.clock import SystemClock
from shared.testing.fake_bluez.packet import measurement
from shared.testing.fake_bluez.strap import FakeBluez
from shared.testing.private_bus import lacks_dbus, private_bus

pytestmark = pytest.mark.skipif(bool(lacks_dbus()), reason=lacks_dbus())

SECONDS = 20.0


@pytest.fixture
def bus(monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder, private_bus(Path(folder)) as address:
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address)
        yield address


@pytest.fixture
def bluez(bus: str) -> Iterator[FakeBluez]:
    with FakeBluez(bus) as bluez:
        yield bluez


@pytest.fixture
def open_strap() -> Iterator[Callable[..., BleStrap]]:
    straps: list[BleStrap] = []

    def open_one(**settings: object) -> BleStrap:
        fast = {"source": "ble", "retry_first": 0.05, "retry_longest": 0.2, "search_seconds": 10.0}
        straps.append(BleStrap(HeartRateConfig(**(fast | settings)), SystemClock()))  # type: ignore[arg-type]
        return straps[-1]

    yield open_one
    for strap in straps:
        strap.close()


def until(condition: Callable[[], object], seconds: float = SECONDS) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "not in time"
        time.sleep(0.01)


def next_beat(strap: BleStrap) -> Beat:
    found: list[Beat] = []
    until(lambda: (beat := strap.take(0.0)) is not None and not found.append(beat))
    return found[0]


def test_a_strap_is_found_heard_and_connected_again_after_a_drop(bluez: FakeBluez, open_strap):
    with capture_logs() as logs:
        strap = open_strap()
        assert bluez.wait_for_listener(SECONDS)
        before = time.monotonic()
        bluez.notify(measurement(72, contact=True, energy=900, intervals=(1024, 512)))
        beat = next_beat(strap)
        assert (beat.beats_per_minute, beat.rr_ms, beat.contact) == (72.0, (1000.0, 500.0), True)
        assert beat.at >= before
        assert strap.name == "Polar OH1 Fake"
        until(lambda: strap.problem == "")  # the first beat may come before the answer

        bluez.drop()
        until(lambda: strap.counters()["heart_rate_drops"] == 1)
        assert bluez.wait_for_listener(SECONDS)
        bluez.notify(measurement(260, contact=False))
        beat = next_beat(strap)
        assert (beat.beats_per_minute, beat.contact) == (260.0, False)
        until(lambda: strap.problem == "")
        assert strap.counters() == {
            "heart_rate_connects": 2, "heart_rate_drops": 1, "heart_rate_refused": 0,
            "heart_rate_lost": 0,
        }  # fmt: skip
        strap.close()
    assert not bluez.is_connected  # a strap that stays connected cannot be found by others
    events = [(line["event"], line.get("reason")) for line in logs]
    assert events == [
        ("heart_rate_connected", None),
        ("heart_rate_unavailable", "the link to the strap was lost"),
        ("heart_rate_connected", None),
    ]


def test_bytes_that_are_no_measurement_are_counted_and_the_next_is_heard(
    bluez: FakeBluez, open_strap
):
    strap = open_strap()
    assert bluez.wait_for_listener(SECONDS)
    for value in (b"\x01\x48", b"\x10\x48\x01", b"", bytes(300)):
        bluez.notify(value)
    bluez.notify(measurement(90))
    assert next_beat(strap).beats_per_minute == 90.0
    assert strap.counters()["heart_rate_refused"] == 4


def test_a_loop_that_does_not_look_loses_the_oldest_and_they_are_counted(
    bluez: FakeBluez, open_strap
):
    strap = open_strap()
    assert bluez.wait_for_listener(SECONDS)
    for rate in range(100, 200):
        bluez.notify(measurement(rate))
    until(lambda: strap.counters()["heart_rate_lost"] == 36)
    assert next_beat(strap).beats_per_minute == 136.0


def test_a_strap_that_says_nothing_is_connected_anew(bluez: FakeBluez, open_strap):
    strap = open_strap(silent_after=1.0)
    until(lambda: bluez.connects == 2)
    assert strap.counters()["heart_rate_drops"] >= 1
    found: list[Beat] = []

    def heard() -> bool:  # by then it may have been silent for long again, and be connected anew
        bluez.notify(measurement(64))
        time.sleep(0.05)
        return (beat := strap.take(0.0)) is not None and not found.append(beat)

    until(heard)
    assert found[0].beats_per_minute == 64.0


def test_a_strap_left_connected_by_a_killed_process_is_taken_over(bluez: FakeBluez, open_strap):
    bluez.connect_from_elsewhere()
    strap = open_strap()
    assert bluez.wait_for_listener(SECONDS)
    bluez.notify(measurement(71))
    assert next_beat(strap).beats_per_minute == 71.0
    assert bluez.connects == 1


@pytest.mark.parametrize(
    "settings", [{"address": "a0:9e:1a:00:00:01"}, {"name": "oh1"}, {"name": "Polar"}]
)
def test_a_strap_is_chosen_by_its_address_or_part_of_its_name(
    bluez: FakeBluez, open_strap, settings
):
    open_strap(**settings)
    assert bluez.wait_for_listener(SECONDS)


@pytest.mark.parametrize("settings", [{"address": "a0:9e:1a:00:00:02"}, {"name": "Wahoo"}])
def test_another_strap_is_left_alone(bluez: FakeBluez, open_strap, settings):
    strap = open_strap(search_seconds=0.5, **settings)
    until(lambda: "no strap" in strap.problem)
    assert strap.problem.startswith(f"no strap {next(iter(settings.values()))} within 0.5 s; wear")
    assert bluez.connects == 0


def test_a_strap_that_refuses_is_asked_again_until_it_does_not(bluez: FakeBluez, open_strap):
    bluez.refuses = True
    with capture_logs() as logs:
        strap = open_strap()
        until(lambda: bluez.refused >= 3)
        assert "br-connection-page-timeout" in strap.problem
        bluez.refuses = False
        assert bluez.wait_for_listener(SECONDS)
        until(lambda: strap.problem == "")
    said = [line["reason"] for line in logs if line["event"] == "heart_rate_unavailable"]
    assert len(said) == 1  # once, however often it refused


def test_an_adapter_that_is_off_is_one_clear_line(bluez: FakeBluez, open_strap):
    bluez.set_powered(False)
    strap = open_strap()
    until(lambda: "powered" in strap.problem)
    assert strap.problem.startswith("No powered Bluetooth adapters found.")
    assert strap.problem.endswith("`bluetoothctl power on`")
    bluez.set_powered(True)
    assert bluez.wait_for_listener(SECONDS)


def test_no_bluez_on_the_bus_is_one_clear_line_and_its_start_is_noticed(bus: str, open_strap):
    strap = open_strap()
    until(lambda: strap.problem == "BlueZ does not run; `systemctl start bluetooth`")
    with FakeBluez(bus) as bluez:
        assert bluez.wait_for_listener(SECONDS)
        strap.close()


def test_a_bus_that_dies_under_the_link_is_survived(monkeypatch, open_strap):
    with tempfile.TemporaryDirectory() as folder:
        with private_bus(Path(folder)) as address, FakeBluez(address) as bluez:
            monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", address)
            strap = open_strap()
            assert bluez.wait_for_listener(SECONDS)
        until(lambda: strap.counters()["heart_rate_drops"] == 1)
        until(lambda: "no system message bus" in strap.problem)
        with private_bus(Path(folder)) as address, FakeBluez(address) as bluez:
            assert bluez.wait_for_listener(SECONDS)
            bluez.notify(measurement(88))
            assert next_beat(strap).beats_per_minute == 88.0
            strap.close()


def test_no_message_bus_is_one_clear_line(monkeypatch: pytest.MonkeyPatch, open_strap):
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", "unix:path=/nonexistent/bus")
    with capture_logs() as logs:
        strap = open_strap()
        until(lambda: strap.problem.startswith("no system message bus"))
        time.sleep(0.3)  # some more tries
        strap.close()
    assert [line["reason"] for line in logs] == [
        "no system message bus (No such file or directory); Bluetooth needs D-Bus and BlueZ: "
        "`apt install bluez`, `systemctl start bluetooth`"
    ]


def test_a_bug_of_a_library_costs_one_try_and_is_logged_once(
    bluez: FakeBluez, open_strap, monkeypatch: pytest.MonkeyPatch
):
    tries: list[int] = []
    find = BleStrap._find

    async def find_late(self: BleStrap):
        tries.append(1)
        if len(tries) < 4:
            raise KeyError("Roles")
        return await find(self)

    monkeypatch.setattr(BleStrap, "_find", find_late)
    with capture_logs() as logs:
        strap = open_strap()
        assert bluez.wait_for_listener(SECONDS)
        until(lambda: strap.problem == "")
    said = [(line["event"], line.get("reason")) for line in logs]
    assert said == [
        ("heart_rate_unavailable", "bug: KeyError: 'Roles'; trying again"),
        ("heart_rate_crashed", None),
        ("heart_rate_connected", None),
    ]


def test_closing_while_it_searches_takes_no_time(bluez: FakeBluez, open_strap):
    bluez.is_advertising = False
    strap = open_strap(search_seconds=60.0)
    until(lambda: bluez.is_discovered)
    before = time.monotonic()
    strap.close()
    assert time.monotonic() - before < 2.0
