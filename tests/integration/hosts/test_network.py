"""Hosts made of network namespaces: links cut, healed, lossy and slow, and no leftovers."""

import contextlib
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from shared.testing.network.commands import no_loss, unavailable
from shared.testing.network.hosts import Host, Network
from shared.testing.network.stale import NAMESPACES, SHARED_MEMORY, prefix, remove_stale
from tests.integration.hosts import echo

pytestmark = pytest.mark.skipif(bool(unavailable()), reason=unavailable())

ECHO = (sys.executable, "-I", "-S", echo.__file__)
NEVER_DONE = """
import sys, time
from pathlib import Path
from shared.testing.network.hosts import Network
host = Network().host("lost")
pid = host.start("sleep", "1000").pid
while Path(f"/proc/{pid}/comm").read_text() != "sleep\\n":  # then it is in the namespace
    time.sleep(0.01)
print(host.namespace, pid, flush=True)
time.sleep(1000)
"""


@pytest.fixture
def network() -> Iterator[Network]:
    with Network() as network:
        yield network


def start_echo(host: Host) -> str:
    """Start it and return what it says of itself."""
    process = host.start(*ECHO, stdout=subprocess.PIPE)
    assert process.stdout is not None
    return process.stdout.readline().decode().strip()


def connect(address: str, port: int = echo.PORT) -> socket.socket:
    connection = socket.create_connection((address, port), timeout=10.0)
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return connection


def test_a_cable_that_is_pulled_loses_what_is_sent_and_nobody_is_told(network: Network):
    near, far = network.host("near"), network.host("far")
    assert start_echo(near) == "near 0"
    assert start_echo(far) == "far 0"
    with connect(near.address) as to_near, connect(far.address) as to_far:
        far.cut()
        to_far.sendall(b"lost?")
        to_far.settimeout(0.3)
        with pytest.raises(TimeoutError):
            to_far.recv(10)
        to_near.sendall(b"others")
        assert to_near.recv(10) == b"others"
        far.heal()
        to_far.settimeout(10.0)
        assert to_far.recv(10) == b"lost?"


def test_hosts_reach_each_other_by_address(network: Network):
    near, far = network.host("near"), network.host("far")
    start_echo(far)
    program = (
        f"import socket; c = socket.create_connection(({far.address!r}, {echo.PORT}), 10); "
        "c.sendall(b'x'); print(c.recv(1), socket.gethostname(), c.getsockname()[0])"
    )
    asked = near.start(sys.executable, "-I", "-S", "-c", program, stdout=subprocess.PIPE)
    assert asked.communicate(timeout=20)[0].decode().split() == ["b'x'", "near", near.address]


@pytest.mark.skipif(bool(no_loss()), reason=no_loss())
def test_a_lossy_link_loses_its_share_in_both_directions_until_it_is_mended(network: Network):
    host = network.host("far")
    start_echo(host)
    assert echoed(host, 100, patience=5.0) == 100
    host.lose(0.5)
    back = sum(echoed(host, 100, patience=0.2) for _ in range(3))
    assert 20 <= back <= 135  # a quarter of 300; 7 standard deviations
    host.lose(0.0)
    assert echoed(host, 100, patience=5.0) == 100


def echoed(host: Host, count: int, patience: float) -> int:
    """Return how many of so many datagrams come back, none later than the patience (s)."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.settimeout(patience)
        for _ in range(count):
            udp.sendto(b"?", (host.address, echo.PORT))
        back = 0
        with contextlib.suppress(TimeoutError):
            while back < count:
                back += len(udp.recv(100))
        return back


def test_a_relay_delays_both_directions_and_keeps_what_it_carries(network: Network):
    near, far = network.host("near"), network.host("far")
    start_echo(far)
    near.relay(7001, f"{far.address}:{echo.PORT}", 0.1)
    program = (
        "import socket, time\n"
        "for _ in range(200):\n"
        "    try: c = socket.create_connection(('127.0.0.1', 7001), 10); break\n"
        "    except OSError: time.sleep(0.02)\n"
        "sent = bytes(range(256)) * 40\n"
        "began = time.monotonic(); c.sendall(sent); back = b''\n"
        "while len(back) < len(sent): back += c.recv(4096)\n"
        "print(back == sent, time.monotonic() - began)"
    )
    asked = near.start(sys.executable, "-I", "-S", "-c", program, stdout=subprocess.PIPE)
    whole, seconds = asked.communicate(timeout=30)[0].decode().split()
    assert whole == "True"
    assert float(seconds) >= 0.2


def test_nothing_of_a_network_stays_behind():
    with Network() as network:
        host = network.host("far")
        process = host.start("sleep", "1000")
        (host.shared_memory / "left").write_bytes(b"x")
        assert process.poll() is None
        cable = f"rp{os.getpid()}."
        assert any(name.startswith(cable) for _, name in socket.if_nameindex())
    assert process.returncode == -signal.SIGKILL
    assert not any(name.startswith(cable) for _, name in socket.if_nameindex())
    for folder in (NAMESPACES, SHARED_MEMORY):
        assert list(folder.glob(f"{prefix()}*")) == []


def test_what_a_killed_process_leaves_is_removed_by_the_next():
    command = [sys.executable, "-c", NEVER_DONE]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as maker:
        assert maker.stdout is not None
        namespace, pid = maker.stdout.readline().decode().split()
        assert remove_stale() == []  # it lives
        maker.kill()
    assert namespace in remove_stale()
    assert not (NAMESPACES / namespace).exists()
    assert not (SHARED_MEMORY / namespace).exists()
    ends = time.monotonic() + 5.0  # it has been killed; a busy machine takes a while to end it
    while not is_gone(pid):
        assert time.monotonic() < ends
        time.sleep(0.01)


def is_gone(pid: str) -> bool:
    try:
        return ") Z " in Path(f"/proc/{pid}/stat").read_text()
    except (FileNotFoundError, ProcessLookupError):
        return True
