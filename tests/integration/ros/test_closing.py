"""What listens is closed while somebody is being let in: nobody is left hanging, nothing leaks."""

import asyncio
import contextlib
import gc
import socket
import warnings
from collections.abc import Awaitable, Callable

import pytest

from shared.ros.listening import Listener
from shared.ros.loop import SocketLoop, received
from shared.ros.xmlrpc import XmlRpcServer

Close = Callable[[], Awaitable[None]]
Listen = Callable[[SocketLoop], Awaitable[tuple[int, Close]]]

ROUNDS = range(8)
"""Of the loop, between the connection and the closing: one of them falls in between."""


def _complaints(do: Callable[[], None]) -> list[str]:
    """Return what Python says of sockets that nobody closed."""
    gc.collect()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        do()
        gc.collect()
    return [str(one.message) for one in said]


async def _xmlrpc(loop: SocketLoop) -> tuple[int, Close]:
    server = XmlRpcServer({})
    return await server.open("127.0.0.1"), server.close


async def _tcpros(loop: SocketLoop) -> tuple[int, Close]:
    async def greet(sock: socket.socket) -> None:
        await received(sock, 4)

    listener = Listener("127.0.0.1", greet, most=4, loop=loop)

    async def close() -> None:
        listener.close()

    return listener.port, close


def _connect_and_close(listen: Listen, rounds: int) -> None:
    loop = SocketLoop("test")

    async def run() -> socket.socket:
        port, close = await listen(loop)
        client = socket.create_connection(("127.0.0.1", port), timeout=5.0)
        for _ in range(rounds):
            await asyncio.sleep(0.0)
        await close()
        return client

    with contextlib.closing(loop.wait_for(run(), 5.0, "a round")) as client:
        loop.close()
        with contextlib.suppress(ConnectionResetError):
            assert client.recv(1) == b""


@pytest.mark.parametrize("listen", [_xmlrpc, _tcpros])
def test_whoever_is_let_in_while_a_node_closes_is_hung_up_on(listen: Listen) -> None:
    for rounds in ROUNDS:
        said = _complaints(lambda rounds=rounds: _connect_and_close(listen, rounds))
        assert said == [], rounds
