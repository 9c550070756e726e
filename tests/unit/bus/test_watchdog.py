"""The watchdog, with a session that is a word; opening another is tested with a real router."""

from collections.abc import Callable

import pytest

from shared.bus.config import BusConfig
from shared.bus.watchdog import Watchdog
from shared.clock import ManualClock
from shared.errors import BusError

CFG = BusConfig(watchdog_seconds=5.0, give_up_seconds=60.0)


class Sessions:
    """What became of them."""

    def __init__(self, has_router: Callable[[str], bool]) -> None:
        self.clock = ManualClock(100.0)
        self.closed: list[str] = []
        self.watchdog = Watchdog(
            CFG, self.clock, "first", has_router, lambda: None, self.closed.append
        )

    def look_after(self, seconds: float) -> bool:
        self.clock.advance(seconds)
        return self.watchdog.look(self.clock.now())


def test_a_session_with_a_router_is_kept_for_ever():
    sessions = Sessions(lambda _: True)
    for _ in range(3):
        assert not sessions.look_after(1000.0)
    assert sessions.watchdog.session == "first"
    assert sessions.closed == []


def test_a_router_that_is_away_for_a_moment_costs_no_session():
    away = [True, True, False, True, True]
    sessions = Sessions(lambda _: not away.pop(0))
    for _ in range(5):
        assert not sessions.look_after(2.5)
    assert sessions.watchdog.session == "first"
    assert sessions.watchdog.without_router() == "no router at tcp/127.0.0.1:7447 for 5.0 s"


def test_without_a_router_for_long_it_gives_up():
    sessions = Sessions(lambda _: False)
    with pytest.raises(
        BusError, match=r"no router at tcp/127\.0\.0\.1:7447 for 60\.1 s: giving up"
    ):
        sessions.look_after(60.1)


def test_a_closed_session_is_not_watched():
    sessions = Sessions(lambda _: False)
    sessions.watchdog.close()
    assert sessions.closed == ["first"]
    assert sessions.watchdog.session is None
    assert not sessions.look_after(1000.0)
    sessions.watchdog.close()
    assert sessions.closed == ["first"]
