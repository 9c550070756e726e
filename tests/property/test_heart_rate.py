"""Whatever a strap sends is a measurement or is refused; what was written is read back."""

import contextlib

from hypothesis import given
from hypothesis import strategies as st

from services.robot_io.heart_rate.packet import parse
from shared.errors import MessageError
from shared.testing.fake_bluez.packet import measurement

U16 = st.integers(0, 0xFFFF)


@given(st.binary(max_size=600))
def test_any_bytes_are_a_measurement_or_refused(value: bytes):
    with contextlib.suppress(MessageError):
        packet = parse(value)
        assert 0 <= packet.beats_per_minute <= 0xFFFF
        assert all(rr >= 0.0 for rr in packet.rr_ms)
        # Nothing of the value went unread.
        head = 2 + (value[0] & 1) + 2 * (packet.energy_kj is not None)
        assert head + 2 * len(packet.rr_ms) == len(value)


@given(U16, st.booleans(), st.none() | st.booleans(), st.none() | U16, st.lists(U16, max_size=9))
def test_what_a_strap_wrote_is_read(
    rate: int, wide: bool, contact: bool | None, energy: int | None, intervals: list[int]
):
    packet = parse(
        measurement(rate, wide=wide, contact=contact, energy=energy, intervals=tuple(intervals))
    )
    assert packet.beats_per_minute == rate
    assert packet.contact is contact
    assert packet.energy_kj == energy
    assert [rr * 1.024 for rr in packet.rr_ms] == intervals
