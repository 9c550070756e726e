"""Closing what listens, without losing whom it has just let in."""

import asyncio
from collections.abc import Iterable
from typing import Protocol


class _Listening(Protocol):
    """A listening socket, or asyncio's view of one."""

    def fileno(self) -> int: ...


class Server(Protocol):
    """What listens: asyncio's server, or one that is made of it."""

    @property
    def sockets(self) -> Iterable[_Listening]:
        """Return what it listens on."""
        ...

    def close(self) -> None:
        """Listen no more."""
        ...


async def close_server(server: Server) -> None:
    """Close a server on its own loop, once those it let in just now have become connections.

    ``asyncio.Server.close`` by itself never closes a connection which was accepted, but whose
    transport is made after the server has been closed.
    """
    loop = asyncio.get_running_loop()
    for sock in server.sockets:
        loop.remove_reader(sock.fileno())
    await asyncio.sleep(0.0)
    server.close()
