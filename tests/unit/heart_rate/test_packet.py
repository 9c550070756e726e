"""The bytes of a heart rate measurement, by hand and hostile."""

import re

import pytest

from services.robot_io.heart_rate.packet import Packet, parse
from shared.errors import MessageError


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("00 48", Packet(beats_per_minute=72)),
        ("06 3c", Packet(beats_per_minute=60, contact=True)),
        ("04 3c", Packet(beats_per_minute=60, contact=False)),
        ("02 3c", Packet(beats_per_minute=60)),  # a strap that cannot tell says nothing by it
        ("01 04 01", Packet(beats_per_minute=260)),
        ("08 5a 10 27", Packet(beats_per_minute=90, energy_kj=10000)),
        ("10 4b 00 04", Packet(beats_per_minute=75, rr_ms=(1000.0,))),
        ("10 4b", Packet(beats_per_minute=75)),  # announces intervals, has none
        ("16 4b 00 02 00 04", Packet(beats_per_minute=75, contact=True, rr_ms=(500.0, 1000.0))),
        (
            "1f 2c 01 01 00 ff ff 01 00",
            Packet(
                beats_per_minute=300, contact=True, energy_kj=1, rr_ms=(63999.0234375, 0.9765625)
            ),
        ),
        ("e0 48", Packet(beats_per_minute=72)),  # flags kept for the future
    ],
)
def test_a_measurement_says_what_its_flags_announce(value: str, expected: Packet):
    assert parse(bytes.fromhex(value)) == expected


@pytest.mark.parametrize(
    "value",
    ["", "00", "01 48", "08 48", "08 48 01", "10 48 01", "00 48 00", "19 48 00 01", "e0 48 00 04"],
)
def test_bytes_that_do_not_fit_their_flags_are_refused(value: str):
    raw = bytes.fromhex(value)
    with pytest.raises(MessageError, match=f"a heart rate of {len(raw)} bytes"):
        parse(raw)


def test_the_longest_value_is_the_longest_of_bluetooth():
    assert len(parse(bytes([0x10, 60]) + bytes(510)).rr_ms) == 255
    with pytest.raises(MessageError, match=re.escape("513 bytes; 2 to 512 are possible")):
        parse(bytes([0x10, 60]) + bytes(511))
