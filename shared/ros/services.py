"""Services: asking one, and answering as one."""

import asyncio
import contextlib
import socket
from collections.abc import Callable
from typing import Any, Final

import structlog

from shared.errors import MessageError
from shared.ros import types
from shared.ros.errors import RosError
from shared.ros.loop import connected, received, tuned
from shared.ros.wire import LARGEST_HEADER, LENGTH, fields_of, framed, header, length_of
from shared.ros.xmlrpc import ask, place_of

IDLE_SECONDS: Final = 60.0
"""A persistent client that asks nothing for so long is let go."""

Handler = Callable[[Any], Any]

log = structlog.get_logger()


class ServiceClient:
    """Asks services by name; remembers where they are. On the loop's thread."""

    def __init__(self, node: str, master_uri: str, largest: int) -> None:
        self._node = node
        self._master_uri = master_uri
        self._largest = largest
        self._places: dict[str, tuple[str, int]] = {}

    async def call(self, service: str, type_name: str, request: Any) -> Any:
        """Return the response; where the service was last is tried before the master is asked.

        Raises:
            RosError: there is no such service, or it refuses, or says that it failed.
        """
        data = types.write(request)
        if (place := self._places.get(service)) is not None:
            with contextlib.suppress(ConnectionRefusedError):
                return await self._exchange(service, type_name, place, data)
            del self._places[service]
        return await self._exchange(service, type_name, await self.locate(service), data)

    async def locate(self, service: str) -> tuple[str, int]:
        """Return where the master says that a service is, and remember it.

        Raises:
            RosError: the master does not answer, or knows of none.
        """
        uri = await ask(self._master_uri, "lookupService", self._node, service)
        self._places[service] = place = place_of(str(uri))
        return place

    async def _exchange(
        self, service: str, type_name: str, place: tuple[str, int], data: bytes
    ) -> Any:
        sock: socket.socket | None = None
        try:
            sock = await connected(*place)
            return await self._talk(sock, service, type_name, data)
        except ConnectionRefusedError:
            raise
        except (OSError, MessageError) as error:
            raise RosError(f"service {service} at {place[0]}:{place[1]}: {error}") from error
        finally:
            if sock is not None:
                sock.close()

    async def _talk(self, sock: socket.socket, service: str, type_name: str, data: bytes) -> Any:
        loop = asyncio.get_running_loop()
        md5 = types.service_md5_of(type_name)
        hello = {"callerid": self._node, "service": service, "type": type_name, "md5sum": md5}
        await loop.sock_sendall(sock, header(hello))
        reply = fields_of(await _framed_part(sock, LARGEST_HEADER))
        if "error" in reply:
            raise RosError(f"service {service} refuses: {reply['error'][:200]}")
        if reply.get("md5sum") not in (md5, "*"):
            raise RosError(
                f"service {service} has md5sum {reply.get('md5sum')}, expected {type_name} "
                f"with {md5}: is its ROS package another version?"
            )
        # only now: rospy drops what it receives together with the header
        await loop.sock_sendall(sock, framed(data))
        is_ok = await received(sock, 1)
        body = await _framed_part(sock, self._largest)
        if is_ok != b"\x01":
            raise RosError(f"service {service} failed: {body.decode('utf-8', 'replace')[:200]}")
        return types.read(f"{type_name}Response", body)


class Service:
    """A service of this node."""

    def __init__(
        self, name: str, type_name: str, handler: Handler, *, node: str, largest: int
    ) -> None:  # fmt: skip
        """Take the settings; ``Node.serve`` makes these."""
        self.name = name
        self.type_name = type_name
        self.md5 = types.service_md5_of(type_name)
        self._handler = handler
        self._node = node
        self._largest = largest
        self.calls = 0
        self.failures = 0

    def refusal(self, asked: dict[str, str]) -> str:
        """Return why a client's header cannot be served; empty if it can."""
        if asked.get("md5sum") in ("*", self.md5):
            return ""
        return (
            f"{self.name} is {self.type_name} with md5sum {self.md5} here, "
            f"not {asked.get('md5sum')}"
        )

    async def serve(self, sock: socket.socket, asked: dict[str, str]) -> None:
        """Answer one client; closes the socket."""
        loop = asyncio.get_running_loop()
        with contextlib.closing(tuned(sock)):
            await loop.sock_sendall(
                sock,
                header(
                    {
                        "callerid": self._node,
                        "type": self.type_name,
                        "request_type": f"{self.type_name}Request",
                        "response_type": f"{self.type_name}Response",
                        "md5sum": self.md5,
                    }
                ),
            )
            if asked.get("probe") == "1":
                return
            while True:
                async with asyncio.timeout(IDLE_SECONDS):
                    body = await _framed_part(sock, self._largest)
                await loop.sock_sendall(sock, await self._answer(body))
                if asked.get("persistent") != "1":
                    return

    async def _answer(self, body: bytes) -> bytes:
        self.calls += 1
        try:
            request = types.read(f"{self.type_name}Request", body)
            response = await asyncio.to_thread(self._handler, request)
            return b"\x01" + framed(types.write(response))
        except Exception as error:  # a handler's bug is its client's answer
            self.failures += 1
            log.warning("ros_service_failed", service=self.name, error=repr(error))
            return b"\x00" + framed(str(error).encode()[:1000])


async def _framed_part(sock: socket.socket, limit: int) -> bytes:
    return await received(sock, length_of(await received(sock, LENGTH), limit))
