import socket
from pathlib import Path

import pytest

from shared.bus.ports import free_port
from shared.clock import ManualClock
from shared.telemetry.door import MOST, FrontDoor, LiveView, read_live_view
from shared.telemetry.viewer import page_url


def visit(door: FrontDoor) -> socket.socket:
    port = int(door.url.rsplit(":", 1)[1])
    visitor = socket.create_connection(("127.0.0.1", port), timeout=5.0)
    visitor.settimeout(5.0)
    return visitor


def test_a_visitor_is_sent_to_the_page() -> None:
    door = FrontDoor("http://127.0.0.1:9/?url=a", 0, ManualClock())
    visitor = visit(door)

    door.tick()
    visitor.sendall(b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
    door.tick()

    answer = visitor.makefile("rb").read()
    assert answer.startswith(b"HTTP/1.1 302 Found\r\nLocation: http://127.0.0.1:9/?url=a\r\n")
    visitor.close()
    door.close()


def test_a_silent_visitor_is_shown_out() -> None:
    clock = ManualClock()
    door = FrontDoor("http://127.0.0.1:9/", 0, clock)
    visitor = visit(door)
    door.tick()

    clock.advance(6.0)
    door.tick()

    assert visitor.recv(1) == b""
    visitor.close()
    door.close()


def test_a_crowd_does_not_hold_the_service_up() -> None:
    door = FrontDoor("http://127.0.0.1:9/", 0, ManualClock())
    visitors = [visit(door) for _ in range(MOST)]

    door.tick()
    door.tick()

    for visitor in visitors:
        visitor.close()
    door.tick()
    door.close()


def test_a_taken_port_gives_way_to_a_free_one() -> None:
    door = FrontDoor("http://127.0.0.1:9/", 0, ManualClock())
    taken = int(door.url.rsplit(":", 1)[1])

    other = FrontDoor("http://127.0.0.1:9/", taken, ManualClock())

    assert other.url != door.url
    assert free_port(taken) != taken
    other.close()
    door.close()


def test_the_page_opens_all_sources() -> None:
    url = page_url(90, ["rerun+http://127.0.0.1:1/proxy", "rerun+http://127.0.0.1:2/proxy"])

    assert url == (
        "http://127.0.0.1:90/?url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A1%2Fproxy"
        "&url=rerun%2Bhttp%3A%2F%2F127.0.0.1%3A2%2Fproxy"
    )


@pytest.mark.parametrize("text", ["", "{", '{"url": 3}', "[]"])
def test_a_damaged_viewer_file_is_no_view(tmp_path: Path, text: str) -> None:
    (tmp_path / "viewer.json").write_text(text)

    assert read_live_view(tmp_path) is None


def test_a_viewer_file_says_where_to_look(tmp_path: Path) -> None:
    (tmp_path / "viewer.json").write_text('{"url": "http://a", "page": "http://b", "pid": 4}')

    assert read_live_view(tmp_path) == LiveView(url="http://a", page="http://b", pid=4)
