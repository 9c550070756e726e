"""A node's entries at the master: made, checked every second, and made again when lost."""

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import Any, Final, cast

import structlog

from shared.ros.errors import RosError
from shared.ros.xmlrpc import ask

CHECK_SECONDS: Final = 1.0
_REFRESH_CHECKS: Final = 5
"""Every so many checks the publishers of all topics are asked for anew."""
_ASK_SECONDS: Final = 2.0
_WHY_SHUT: Final = "another node of this name has come; each robot-io needs a name of its own"

Follow = Callable[[list[str]], None]

log = structlog.get_logger()


class Registration:
    """What the master knows of one node; lives on the loop's thread."""

    def __init__(self, node: str, uri: str, master_uri: str) -> None:
        """Know nothing of the master yet.

        Args:
            node: its name.
            uri: where its own API is.
            master_uri: where the master's is.
        """
        self._node = node
        self._uri = uri
        self._master_uri = master_uri
        self._entries: dict[tuple[str, str], tuple[Any, ...]] = {}
        self._follows: dict[str, Follow] = {}
        self._known: set[tuple[str, str]] = set()
        self._count = 0
        """Entries asked for, from any thread, whether they have got here or not."""
        self._lock = threading.Lock()
        self._news = asyncio.Event()
        self._complete = threading.Event()
        self._checks = 0
        self.problem = f"the ROS master at {master_uri} has not answered yet"
        self.is_shut_down = False

    def add_publication(self, loop: asyncio.AbstractEventLoop, topic: str, kind: str) -> None:
        """Enter a topic that the node writes; from any thread."""
        self._add(loop, ("registerPublisher", topic), (kind, self._uri), None)

    def add_subscription(
        self, loop: asyncio.AbstractEventLoop, topic: str, kind: str, follow: Follow
    ) -> None:  # fmt: skip
        """Enter a topic that it reads; ``follow`` is told who publishes it."""
        self._add(loop, ("registerSubscriber", topic), (kind, self._uri), follow)

    def add_service(self, loop: asyncio.AbstractEventLoop, service: str, uri: str) -> None:
        """Enter a service that it answers at ``uri``."""
        self._add(loop, ("registerService", service), (uri, self._uri), None)

    @property
    def is_complete(self) -> bool:
        """Return whether the master knows all entries."""
        return self._complete.is_set()

    def wait(self, seconds: float) -> bool:
        """Wait until it does, from another thread; returns whether it does."""
        return self._complete.wait(seconds)

    def be_shut_down(self, why: str) -> None:
        """Take it from the master that this node has to go."""
        self.is_shut_down = True
        self.problem = f"the ROS master has ended {self._node} ({why[:100]}): {_WHY_SHUT}"
        self._complete.clear()

    async def keep(self) -> None:
        """Register what is new, look every second whether the master still knows it, for ever."""
        while not self.is_shut_down:
            try:
                await self._check()
                await self._enter()
            except (RosError, TimeoutError) as error:
                self._lose(error)
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(CHECK_SECONDS):
                    await self._news.wait()
            self._news.clear()

    async def leave(self) -> None:
        """Take all entries back."""
        for method, name in tuple(self._known):
            uri = self._entries[method, name][0] if method == "registerService" else self._uri
            with contextlib.suppress(RosError):
                await self._ask(method.replace("register", "unregister"), name, uri)
        self._known.clear()

    def _add(
        self, loop: asyncio.AbstractEventLoop, key: tuple[str, str], entry: tuple[Any, ...],
        follow: Follow | None,
    ) -> None:  # fmt: skip
        with self._lock:
            self._complete.clear()
            self._count += 1

        def add() -> None:
            self._entries[key] = entry
            if follow is not None:
                self._follows[key[1]] = follow
            self._news.set()

        loop.call_soon_threadsafe(add)

    async def _check(self) -> None:
        """Forget what was entered where the master has forgotten this node."""
        if not self._known:
            await self._ask("getPid")
            return
        self._checks += 1
        try:
            found = await self._ask("lookupNode", self._node)
        except RosError as error:
            if "refuses" not in str(error):
                raise
            found = ""
        if found != self._uri:
            log.warning("ros_master_forgot_us", master=self._master_uri, found=found)
            self._complete.clear()
            self._known.clear()
        elif self._checks % _REFRESH_CHECKS == 0:
            self._known -= {key for key in self._known if key[0] == "registerSubscriber"}

    async def _enter(self) -> None:
        for key, entry in tuple(self._entries.items()):
            if key in self._known:
                continue
            method, name = key
            found = await self._ask(method, name, *entry)
            if method == "registerSubscriber":
                self._follows[name](texts_of(found))
            self._known.add(key)
        if not self.is_shut_down:
            self.problem = ""
            with self._lock:
                if len(self._known) == self._count:
                    self._complete.set()

    async def _ask(self, method: str, *arguments: Any) -> Any:
        async with asyncio.timeout(_ASK_SECONDS):
            return await ask(self._master_uri, method, self._node, *arguments)

    def _lose(self, error: Exception) -> None:
        if not self.problem:
            log.warning("ros_master_lost", master=self._master_uri, error=str(error))
        self._complete.clear()
        self.problem = (
            f"no ROS master at {self._master_uri} ({error or 'no answer'}): "
            "is the robot on, and is master_uri right?"
        )


def texts_of(found: object) -> list[str]:
    """Return a list of texts as it came over XML-RPC; what is none of it counts as nothing."""
    if not isinstance(found, list):
        return []
    return [text for text in cast("list[object]", found) if isinstance(text, str)]
