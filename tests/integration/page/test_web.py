"""The page's server over real sockets, with the client of the same library."""

import json
import socket
import struct
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from services.page.assets import load_assets
from services.page.protocol import MAX_BYTES, GateAsk
from services.page.web import Web
from shared.errors import ConfigError
from shared.runtime.talk import MISBEHAVED, TAKEN_OVER

ARM = '{"type":"gate","action":"arm"}'


def pose(sequence: int) -> bytes:
    return struct.pack("<6d", sequence, 0.4, 0.1, 1.2, 0.0, 1.0)


@pytest.fixture
def web() -> Iterator[Web]:
    made = Web("127.0.0.1", 0, ("http://lab-pc:8765",), load_assets({"links": []}))
    yield made
    made.close()


def opened(web: Web, origin: str | None = "own", **more: int) -> ClientConnection:
    origin = web.url if origin == "own" else origin
    return connect(
        web.url.replace("http", "ws") + "/bout", origin=origin, compression=None,  # type: ignore[arg-type]
        open_timeout=5, close_timeout=1, **more,  # type: ignore[arg-type]
    )  # fmt: skip


def talk_nonsense(page: ClientConnection) -> None:
    for _ in range(200):
        page.send("nonsense")
    page.recv(timeout=5)


def until(condition: Callable[[], object], seconds: float = 5.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def fetch(web: Web, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    try:
        with urllib.request.urlopen(
            urllib.request.Request(web.url + path, headers=headers), timeout=5
        ) as answer:
            return answer.status, answer.read(), dict(answer.headers)
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read(), dict(error.headers)


@pytest.mark.parametrize(
    ("path", "kind", "text"),
    [
        ("/", "text/html", b"<title>Riposte</title>"),
        ("/main.js?quality=fine", "text/javascript", b"Pointing"),
        ("/vendor/three.module.min.js", "text/javascript", b"WebGLRenderer"),
        ("/vendor/three.core.min.js", "text/javascript", b"Three.js Authors"),
        ("/vendor/three.LICENSE", "text/plain", b"MIT License"),
        ("/scene.json", "application/json", b'{"links":[]}'),
    ],
)
def test_the_files_of_the_page_are_served(web: Web, path: str, kind: str, text: bytes):
    status, body, headers = fetch(web, path)
    assert status == 200
    assert text in body
    assert headers["Content-Type"].startswith(kind)
    assert "default-src 'none'" in headers["Content-Security-Policy"]


@pytest.mark.parametrize(
    "path", ["/service.py", "/../service.py", "/%2e%2e/service.py", "/vendor", "//etc/passwd"]
)
def test_nothing_else_is_served(web: Web, path: str):
    assert fetch(web, path)[0] == 404


def test_nothing_of_the_page_comes_from_elsewhere():
    for path, asset in load_assets({}).items():
        if not path.startswith("/vendor"):
            assert b"https://" not in asset.body, path
            assert b"@import" not in asset.body, path


def test_poses_and_wishes_arrive_and_frames_and_notes_go_out(web: Web):
    with opened(web) as page:
        until(lambda: web.session == 1)
        page.send(pose(0))
        page.send(pose(1))
        page.send(ARM)
        until(lambda: web.counters["poses_received"] == 2)
        pointer = web.take_pointer()
        assert pointer is not None
        assert (pointer.session, pointer.sequence, pointer.tip) == (1, 1, (0.4, 0.1, 1.2))
        assert web.take_pointer() is None
        until(lambda: (ask := web.take_ask()) is None or ask == GateAsk("arm"))
        web.tell(b'{"type":"note"}')
        assert json.loads(page.recv(timeout=5)) == {"type": "note"}
        web.show(b'{"type":"frame"}')
        assert json.loads(page.recv(timeout=5)) == {"type": "frame"}
    until(lambda: web.session == 0)


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "http://127.0.0.1:1", "https://127.0.0.1", "null"]
)
def test_a_foreign_page_is_refused_and_counted(web: Web, origin: str):
    with pytest.raises(InvalidStatus) as caught:
        opened(web, origin)
    assert caught.value.response.status_code == 403
    assert web.counters["pages_refused"] == 1
    assert web.last_refusal.startswith(f"refused: origin '{origin}' is none of this page's")
    assert fetch(web, "/", Origin=origin)[0] == 403
    assert web.session == 0


def test_a_foreign_name_for_this_machine_is_refused(web: Web):
    assert fetch(web, "/", Host="evil.example")[0] == 403
    assert fetch(web, "/", Host="evil.example:80")[0] == 403
    assert fetch(web, "/", Host=f"localhost:{web.port}")[0] == 200


def test_an_address_of_the_site_file_is_let_in(web: Web):
    with opened(web, "http://lab-pc:8765"):
        until(lambda: web.session == 1)


def test_messages_that_cannot_be_read_are_counted_and_the_page_stays(web: Web):
    with opened(web) as page:
        page.send(b"too short")
        page.send("{")
        page.send(struct.pack("<6d", 0, float("nan"), 0, 0, 0, 1))
        page.send(pose(0))
        page.send(pose(0))
        until(lambda: web.counters["messages_refused"] == 4)
        assert web.counters["poses_received"] == 1
        assert web.last_refusal == "sequence of a pose is 0, expected a count above 0"
        assert web.session == 1


def test_a_message_that_is_too_long_ends_the_page_and_is_counted(web: Web):
    with opened(web) as page:
        page.send(b"x" * (MAX_BYTES + 1))
        with pytest.raises(ConnectionClosed) as caught:
            page.recv(timeout=5)
    assert caught.value.rcvd is not None
    assert caught.value.rcvd.code == 1009
    until(lambda: web.counters["messages_refused"] == 1)
    assert web.last_refusal == f"a message is longer than {MAX_BYTES} bytes"


def test_a_page_that_says_nothing_but_nonsense_is_sent_away(web: Web):
    with opened(web) as page:
        with pytest.raises(ConnectionClosed) as caught:
            talk_nonsense(page)
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == MISBEHAVED


def test_a_second_page_takes_over_and_the_first_is_told(web: Web):
    with opened(web) as first:
        until(lambda: web.session == 1)
        first.send(ARM)
        until(lambda: web._asks)
        with opened(web) as second:
            until(lambda: web.session == 2)
            with pytest.raises(ConnectionClosed) as caught:
                first.recv(timeout=5)
            assert caught.value.rcvd is not None
            assert (caught.value.rcvd.code, caught.value.rcvd.reason) == (
                TAKEN_OVER, "another page plays now",
            )  # fmt: skip
            assert web.take_ask() is None  # what the old page wished does not count any more
            web.show(b"{}")
            assert second.recv(timeout=5) == "{}"
            assert web.counters["pages_replaced"] == 1


def test_a_browser_that_does_not_read_drops_frames_and_holds_nobody_up(web: Web):
    frame = json.dumps({"type": "frame", "fill": "x" * 16000}).encode()
    with opened(web, max_queue=1) as page:
        page.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        until(lambda: web.session == 1)
        took: list[float] = []
        for _ in range(1000):
            before = time.monotonic()
            web.show(frame)
            took.append(time.monotonic() - before)
            time.sleep(0.0002)
        until(lambda: web.counters["frames_dropped"] > 100)
        counters = web.counters
        assert counters["frames_sent"] + counters["frames_dropped"] <= 1000
        assert sorted(took)[len(took) // 2] < 0.001
        for _ in range(100):
            web.tell(b"{}")
        assert web._session is not None
        assert len(web._session.notes) <= 32


def test_wishes_beyond_the_bound_are_dropped_and_counted(web: Web):
    with opened(web) as page:
        for _ in range(40):
            page.send(ARM)
        until(lambda: web.counters["wishes_dropped"] == 24)
        taken = 0
        while web.take_ask() is not None:
            taken += 1
        assert taken == 16


def test_a_taken_port_is_said_in_one_line(web: Web):
    with pytest.raises(ConfigError) as caught:
        Web("127.0.0.1", web.port, (), load_assets({}))
    assert str(caught.value) == (
        f"cannot serve the page on 127.0.0.1:{web.port} (Address already in use): stop what "
        "listens there, or set page.host and page.port to what is free"
    )


def test_the_page_is_told_when_the_service_ends(web: Web):
    with opened(web) as page:
        until(lambda: web.session == 1)
        web.close()
        with pytest.raises(ConnectionClosed) as caught:
            page.recv(timeout=5)
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == 1001


def test_a_browser_that_reads_slowly_still_gets_whole_files(web: Web):
    with socket.create_connection(("127.0.0.1", web.port), timeout=10) as slow:
        slow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
        host = web.url.removeprefix("http://")
        slow.sendall(f"GET /vendor/three.core.min.js HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        time.sleep(1.2)
        received = 0
        while chunk := slow.recv(65536):
            received += len(chunk)
    assert received > len(load_assets({})["/vendor/three.core.min.js"].body)


def test_a_browser_that_never_answers_does_not_hold_up_the_end():
    web = Web("127.0.0.1", 0, (), load_assets({}))
    with socket.create_connection(("127.0.0.1", web.port), timeout=10) as deaf:
        host = web.url.removeprefix("http://")
        deaf.sendall(
            f"GET /bout HTTP/1.1\r\nHost: {host}\r\nUpgrade: websocket\r\n"
            "Connection: Upgrade\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
            "Sec-WebSocket-Version: 13\r\n\r\n".encode()
        )
        until(lambda: web.session == 1)
        began_at = time.monotonic()
        web.close()
        assert time.monotonic() - began_at < 8.0
