"""The web server behind the metrics: real sockets, so many places, so long a request."""

import contextlib
import http
import socket
import time
import urllib.request
from collections.abc import Iterator

import pytest

from services.metrics import web as module
from services.metrics.web import MAX_CONNECTIONS, Answer, Web

ENOUGH = 60.0
"""A web that has not done it in so long never will (s)."""


def answer(path: str) -> Answer | None:
    return Answer(http.HTTPStatus.OK, "text/plain", b"ok\n") if path == "/" else None


@pytest.fixture
def web() -> Iterator[Web]:
    made = Web("127.0.0.1", 0, answer)
    yield made
    made.close()


@contextlib.contextmanager
def held(web: Web, count: int) -> Iterator[list[socket.socket]]:
    """Connections of clients that say nothing."""
    with contextlib.ExitStack() as stack:
        yield [
            stack.enter_context(socket.create_connection(("127.0.0.1", web.port), timeout=ENOUGH))
            for _ in range(count)
        ]


def served(web: Web) -> bool:
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{web.port}/", timeout=ENOUGH) as got:
            return got.status == 200
    except OSError:
        time.sleep(0.05)
        return False


def test_more_than_its_places_are_refused_and_a_place_left_is_free_again(
    web: Web, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(module, "DEADLINE", 2 * ENOUGH)
    until = time.monotonic() + ENOUGH
    with held(web, MAX_CONNECTIONS + 8):
        while web.counters["connections_refused"] < 8:
            assert time.monotonic() < until, web.counters
            time.sleep(0.01)
        assert not served(web)
        assert web.counters == {"scrapes": 0, "connections_refused": 9}
    while not served(web):
        assert time.monotonic() < until


def test_whoever_holds_a_place_and_says_nothing_is_sent_away(
    web: Web, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(module, "DEADLINE", 0.2)
    with held(web, MAX_CONNECTIONS) as idle:
        for client in idle:
            with contextlib.suppress(ConnectionResetError):
                assert client.recv(1) == b""
        assert served(web)
