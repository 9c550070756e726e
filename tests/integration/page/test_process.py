"""The page's process with a client that is no browser: real sockets, real Zenoh, real robot_io."""

import json
import os
import struct
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from websockets.sync.client import ClientConnection, connect

from tests.integration.page.live import LiveSite

pytestmark = pytest.mark.zenoh


class Client:
    """Beats as a page does, and notes how long an echo takes."""

    def __init__(self, socket: ClientConnection) -> None:
        self.socket = socket
        self.sequence = -1
        self.sent_at: dict[int, float] = {}
        self.frames: list[dict[str, Any]] = []
        self.notes: list[dict[str, Any]] = []
        self.latencies: list[float] = []

    def point(self, x: float, y: float, z: float) -> None:
        self.sequence += 1
        self.sent_at[self.sequence] = time.monotonic()
        self.socket.send(struct.pack("<6d", self.sequence, x, y, z, 0.0, 1.0))

    def take(self, seconds: float) -> None:
        """Receive for so long."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            try:
                said = json.loads(self.socket.recv(timeout=left))
            except TimeoutError:
                return
            if said["type"] != "frame":
                self.notes.append(said)
                continue
            self.frames.append(said)
            now = time.monotonic()
            for sequence in [s for s in self.sent_at if s <= said["echo"]]:
                self.latencies.append(now - self.sent_at.pop(sequence))


@pytest.fixture
def site(tmp_path: Path) -> Iterator[LiveSite]:
    made = LiveSite(tmp_path)
    yield made
    made.close()


def test_poses_of_a_client_come_back_as_bat_states_until_it_falls_silent(
    site: LiveSite, capsys: pytest.CaptureFixture[str]
):
    site.service("robot_io", "--set", "robot_io.tracker=mouse")
    url = site.page()
    place = json.loads((site.folder / "page.json").read_bytes())
    assert place == {"url": url, "pid": site.processes["page"].pid}
    site.until(lambda: site.bats)
    with connect(
        url.replace("http", "ws") + "/bout",
        origin=url,
        compression=None,  # type: ignore[arg-type]
    ) as socket:
        client = Client(socket)
        deadline = time.monotonic() + 30.0
        k = 0
        while k < 300 or not client.frames[-1]["is_valid"][0]:
            assert time.monotonic() < deadline
            client.point(0.45, 0.2 + 0.15 * np.sin(k / 40), 1.3)
            client.take(0.01)
            k += 1
        site.listen()
        assert site.bats[-1].tracker_source
        assert client.frames[-1]["missing"] == ["the referee", "the policy"]
        assert [note["type"] for note in client.notes[:2]] == ["hello", "results"]
        ms = 1e3 * np.array(client.latencies[100:])
        p50, p90 = np.percentile(ms, (50, 90))
        with capsys.disabled():
            sys.stdout.write(
                f"\npose to bat state over the socket and back: p50 {p50:.1f} ms, p90 {p90:.1f} ms "
                f"({len(ms)} poses)\n"
            )
        assert 0.0 < p50 < 500.0

        client.take(0.5)  # it says nothing any more
        site.until(lambda: not site.bats[-1].is_valid[0])
        client.take(0.2)
        assert client.frames[-1]["is_lost"]
        client.socket.send('{"type":"bout","action":"start"}')
        client.take(0.5)
        assert client.notes[-1]["lines"] == ["waiting for the referee, the policy"]

    page = site.processes["page"]
    page.terminate()
    assert page.wait(20) == 0
    assert not (site.folder / "page.json").exists()


def test_a_port_that_is_taken_ends_the_process_with_one_line(site: LiveSite):
    url = site.page()
    port = url.rpartition(":")[2]
    read, write = os.pipe()
    first = site.processes.pop("page")
    site.processes["first"] = first
    with os.fdopen(read, "rb") as said:
        settings = ("--name", "page-1", "--set", f"page.port={port}")
        second = site.service("page", *settings, stderr=write)
        os.close(write)
        assert second.wait(30) == 2
        lines = said.read().decode().splitlines()
    assert lines[-1].startswith(f"page-1: cannot serve the page on 127.0.0.1:{port} (Address")
    assert not any("Traceback" in line for line in lines)
