"""The one thread of a node's sockets: an asyncio loop, closed in order; and how they are made."""

import asyncio
import contextlib
import socket
import threading
from collections.abc import Coroutine
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Any, Final, TypeVar

import structlog

from shared.ros.errors import RosError
from shared.ros.xmlrpc import place_of

WORKERS: Final = 4
"""Threads for what may take a while: names of machines, handlers of services."""
_CLOSE_SECONDS: Final = 2.0
_CLOSE_ROUNDS: Final = 5

T = TypeVar("T")

log = structlog.get_logger()


class SocketLoop:
    """An event loop in a daemon thread."""

    def __init__(self, name: str) -> None:
        """Start it.

        Args:
            name: of the node, for the names of the threads.
        """
        self._loop = asyncio.new_event_loop()
        self._workers = ThreadPoolExecutor(WORKERS, thread_name_prefix=f"ros{name}")
        self._loop.set_default_executor(self._workers)
        self._loop.set_exception_handler(_report)
        self._tasks: set[asyncio.Task[Any]] = set()
        self._thread = threading.Thread(target=self._run, name=f"ros{name}", daemon=True)
        self._thread.start()

    @property
    def events(self) -> asyncio.AbstractEventLoop:
        """Return the loop itself, to be used on its own thread."""
        return self._loop

    def wait_for(self, work: Coroutine[Any, Any, T], seconds: float, what: str) -> T:
        """Run something on the loop and return its result, from another thread.

        Raises:
            RosError: it took longer, or the loop is closed; says what.
        """
        bounded = _within(work, seconds)
        try:
            future = asyncio.run_coroutine_threadsafe(bounded, self._loop)
        except RuntimeError as error:
            bounded.close()
            work.close()
            raise RosError(f"{what}: the ROS node is closed") from error
        try:
            return future.result(seconds + 1.0)
        except (TimeoutError, FutureTimeout) as error:
            future.cancel()
            raise RosError(f"{what}: no answer within {seconds:g} s") from error

    def start(self, work: Coroutine[Any, Any, None]) -> None:
        """Begin something on the loop, from any thread, that ends with it at the latest."""
        self._loop.call_soon_threadsafe(self.begin, work)

    def begin(self, work: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        """The same on the loop's own thread; returns the task."""
        task = self._loop.create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._ended)
        return task

    def close(self) -> None:
        """End what runs and stop the thread; a second call does nothing."""
        if self._loop.is_closed():
            return
        with contextlib.suppress(RosError):
            self.wait_for(self._cancel_all(), _CLOSE_SECONDS, "closing")
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(_CLOSE_SECONDS)
        self._workers.shutdown(wait=False, cancel_futures=True)
        if not self._thread.is_alive():
            self._loop.close()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_forever()

    async def _cancel_all(self) -> None:
        # Not only those begun here: a server makes tasks of its own of each connection, and a
        # transport that was closed lets go of its socket a little later.
        for _ in range(_CLOSE_ROUNDS):
            tasks = asyncio.all_tasks() - {asyncio.current_task()}
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)
            await asyncio.sleep(0.0)
        await self._loop.shutdown_asyncgens()

    def _ended(self, task: asyncio.Task[Any]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (error := task.exception()) is not None:
            log.error("ros_task_failed", error=repr(error))


async def _within(work: Coroutine[Any, Any, T], seconds: float) -> T:
    async with asyncio.timeout(seconds):
        return await work


def _report(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
    log.warning(
        "ros_socket_failed", what=context.get("message"), error=repr(context.get("exception"))
    )


def tuned(sock: socket.socket) -> socket.socket:
    """Return a connected socket that sends at once and finds out when the other end vanishes."""
    sock.setblocking(False)
    for level, option, value in (
        (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1),
        (socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1),
        (socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 2),
        (socket.IPPROTO_TCP, socket.TCP_KEEPINTVL, 1),
        (socket.IPPROTO_TCP, socket.TCP_KEEPCNT, 3),
        (socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, 5000),
    ):
        with contextlib.suppress(OSError):
            sock.setsockopt(level, option, value)
    return sock


async def connected(host: str, port: int) -> socket.socket:
    """Return a tuned socket to a machine, within the time of whoever waits for this.

    Raises:
        OSError: nobody is there.
    """
    loop = asyncio.get_running_loop()
    found = await loop.getaddrinfo(host, port, family=socket.AF_INET, type=socket.SOCK_STREAM)
    sock = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        tuned(sock)
        await loop.sock_connect(sock, found[0][4])
    except BaseException:
        sock.close()
        raise
    return sock


async def received(sock: socket.socket, size: int) -> bytes:
    """Return exactly so many bytes.

    Raises:
        ConnectionError: the other end closed before.
    """
    loop = asyncio.get_running_loop()
    data = bytearray()
    while len(data) < size:
        part = await loop.sock_recv(sock, min(size - len(data), 1 << 16))
        if not part:
            raise ConnectionResetError("the other end closed the connection")
        data += part
    return bytes(data)


def own_address(master_uri: str) -> str:
    """Return the address that this machine has towards the master; nothing is sent.

    Raises:
        RosError: the master's name is unknown, or there is no way to it.
    """
    host, port = place_of(master_uri)
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.connect((host, port))
            return str(probe.getsockname()[0])
    except OSError as error:
        raise RosError(
            f"no way to the ROS master at {master_uri}: {error.strerror or error}; "
            "is this machine on the robot's network?"
        ) from error
