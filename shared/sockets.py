"""Closing what listens, without losing whom it has just let in."""

import asyncio
from collections.abc import Iterable
from typing import Protocol


class Listening(Protocol):
    """A listening socket, or asyncio's view of one."""

    def fileno(self) -> int:
        """Return its descriptor."""
        ...


async def stop_accepting(sockets: Iterable[Listening]) -> None:
    """Let nobody in any more, and let those become connections who were let in just now.

    To be awaited on the server's own loop before ``asyncio.Server.close``: that one never closes a
    connection which was accepted, but whose transport is made after the server has been closed.
    """
    loop = asyncio.get_running_loop()
    for sock in sockets:
        loop.remove_reader(sock.fileno())
    await asyncio.sleep(0.0)
