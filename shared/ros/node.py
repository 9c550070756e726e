"""A ROS node: what it writes, reads, asks and answers, kept registered with the master.

::

    node = Node("/riposte", "http://10.68.255.1:11311", clock=clock)
    command = node.publish_topic("/r_cart/command_pose", "geometry_msgs/PoseStamped", queue=1)
    state = node.subscribe("/joint_states", "sensor_msgs/JointState", queue=1)
    command.publish(types.new("geometry_msgs/PoseStamped", header=..., pose=...))  # never blocks
    if (newest := state.take()) is not None:                                       # never blocks
        newest.message.position, newest.at, newest.wall_ns
    reply = node.call("/a/service", "std_srvs/Trigger", types.new("std_srvs/TriggerRequest"), 1.0)
    node.serve("/b/service", "std_srvs/Empty", lambda request: types.new("std_srvs/EmptyResponse"))
    node.close()

One thread reads and writes all sockets; at most ``loop.WORKERS`` more run handlers of services.
A master that is absent or restarts is no error: everything is registered again when it is back.
"""

import asyncio
import contextlib
import os
import re
import socket
import threading
from typing import Any, Final

import structlog

from shared.clock import Clock, SystemClock
from shared.errors import MessageError
from shared.ros.errors import RosError
from shared.ros.listening import Listener
from shared.ros.loop import SocketLoop, own_address, received
from shared.ros.publishing import Publication
from shared.ros.registration import Registration, texts_of
from shared.ros.services import Handler, Service, ServiceClient
from shared.ros.subscribing import Subscription
from shared.ros.wire import (
    LARGEST_HEADER,
    LARGEST_MESSAGE,
    LENGTH,
    fields_of,
    header,
    length_of,
)
from shared.ros.xmlrpc import Method, XmlRpcServer, ask

MASTER_SECONDS: Final = 2.0
"""Longest wait for the master's answer, where a caller gives no other."""
_HANDSHAKE_SECONDS: Final = 5.0
_MOST_CONNECTIONS: Final = 128
_NAME: Final = re.compile(r"(/[A-Za-z][A-Za-z0-9_]*)+")

log = structlog.get_logger()


class Node:
    """One node of a ROS graph."""

    def __init__(
        self,
        name: str,
        master_uri: str,
        host: str = "",
        clock: Clock | None = None,
        largest_message: int = LARGEST_MESSAGE,
    ) -> None:
        """Open the node's own sockets and begin to look for the master; returns at once.

        Args:
            name: ``/riposte``; a second node of the same name makes the master end the first.
            master_uri: ``http://host:port``.
            host: address or name under which the other machines reach this one; it is listened
                on there and nowhere else. Empty: the address that this machine has towards the
                master.
            clock: measures when messages arrive.
            largest_message: bytes; a connection that announces more is closed.

        Raises:
            RosError: the master's address, this node's name or this machine's address cannot be.
        """
        _check_name(name, "a node")
        self.name = name
        self.master_uri = master_uri
        self.host = host or own_address(master_uri)
        self._clock = clock or SystemClock()
        self._largest = largest_message
        self._lock = threading.Lock()
        self._publications: dict[str, Publication] = {}
        self._subscriptions: dict[str, Subscription] = {}
        self._services: dict[str, Service] = {}
        self._refused = 0
        self._is_closed = False
        self._api = XmlRpcServer(self._methods())
        self._loop = SocketLoop(name)
        try:
            port = self._wait(self._open(), MASTER_SECONDS, "opening the node's sockets")
        except BaseException:
            self._loop.close()
            raise
        self.uri = f"http://{self.host}:{port}/"
        self._client = ServiceClient(name, master_uri, largest_message)
        self._registration = Registration(name, self.uri, master_uri)
        self._loop.start(self._registration.keep())

    def publish_topic(
        self, topic: str, type_name: str, *, latch: bool = False, queue: int = 1
    ) -> Publication:
        """Return the writer of a topic.

        Args:
            topic: ``/r_cart/command_pose``.
            type_name: ``geometry_msgs/PoseStamped``.
            latch: whether a new subscriber gets the last message at once.
            queue: messages kept for a subscriber that is slow; older ones are dropped.
        """
        _check_name(topic, "a topic")
        with self._lock:
            if topic in self._publications:
                raise ValueError(f"{topic} is published by this node already")
            publication = Publication(
                topic, type_name, latch=latch, queue=_queue(queue), node=self.name,
                loop=self._loop.events,
            )  # fmt: skip
            self._publications[topic] = publication
        self._registration.add_publication(self._loop.events, topic, type_name)
        return publication

    def subscribe(self, topic: str, type_name: str, *, queue: int = 1) -> Subscription:
        """Return the reader of a topic: polled with ``take``, the newest ``queue`` messages."""
        _check_name(topic, "a topic")
        with self._lock:
            if topic in self._subscriptions:
                raise ValueError(f"{topic} is read by this node already")
            subscription = Subscription(
                topic, type_name, queue=_queue(queue), node=self.name, clock=self._clock,
                loop=self._loop, largest=self._largest,
            )  # fmt: skip
            self._subscriptions[topic] = subscription
        self._registration.add_subscription(
            self._loop.events, topic, type_name, subscription.follow
        )
        return subscription

    def call(self, service: str, type_name: str, request: Any, timeout: float) -> Any:
        """Return a service's response; blocks, for ``timeout`` seconds at most.

        Args:
            service: ``/pr2_controller_manager/list_controllers``.
            type_name: ``pr2_mechanism_msgs/ListControllers``.
            request: made with ``types.new("<type_name>Request", ...)``.
            timeout: s.

        Raises:
            RosError: no such service, no answer in time, or it says that it failed.
        """
        work = self._client.call(service, type_name, request)
        try:
            return self._wait(work, timeout, f"service {service}")
        except (OSError, MessageError) as error:
            raise RosError(f"service {service}: {error}") from error

    def locate(self, service: str, timeout: float = MASTER_SECONDS) -> None:
        """Ask the master where a service is, so that a later call need not.

        Raises:
            RosError: the master does not answer, or there is no such service.
        """
        self._wait(self._client.locate(service), timeout, f"service {service}")

    def serve(self, service: str, type_name: str, handler: Handler) -> Service:
        """Answer a service.

        Args:
            service: its name.
            type_name: of the service.
            handler: takes the request, returns the response, in a worker's thread; several may
                run at once. What it raises is the client's error.
        """
        _check_name(service, "a service")
        with self._lock:
            if service in self._services:
                raise ValueError(f"{service} is served by this node already")
            served = Service(service, type_name, handler, node=self.name, largest=self._largest)
            self._services[service] = served
        self._registration.add_service(
            self._loop.events, service, f"rosrpc://{self.host}:{self._listener.port}"
        )
        return served

    def param(self, name: str, default: Any = None, timeout: float = MASTER_SECONDS) -> Any:
        """Return a parameter, ``default`` where it is not set; blocks for ``timeout`` at most.

        Raises:
            RosError: the master does not answer.
        """
        what = f"parameter {name}"
        if not self._wait(self._ask("hasParam", name), timeout, what):
            return default
        return self._wait(self._ask("getParam", name), timeout, what)

    def set_param(self, name: str, value: Any, timeout: float = MASTER_SECONDS) -> None:
        """Set a parameter: numbers, text, truth values, lists and dicts of them."""
        self._wait(self._ask("setParam", name, value), timeout, f"parameter {name}")

    def publishers_of(self, topic: str, timeout: float = MASTER_SECONDS) -> tuple[str, ...]:
        """Return the names of all nodes that publish a topic, this one included."""
        state = self._wait(self._ask("getSystemState"), timeout, "the master's state")
        return _nodes_of(state, topic)

    @property
    def is_registered(self) -> bool:
        """Return whether the master knows all of this node now."""
        return self._registration.is_complete

    @property
    def problem(self) -> str:
        """Return what is wrong with the master, or between it and this node; empty if nothing."""
        return self._registration.problem

    @property
    def refused(self) -> int:
        """Return how many connections were no ROS node's, or one too many."""
        return self._refused + self._listener.refused

    @property
    def is_shut_down(self) -> bool:
        """Return whether the master has ended this node, for another of its name has come."""
        return self._registration.is_shut_down

    def wait_registered(self, timeout: float) -> None:
        """Wait until the master knows all of this node.

        Raises:
            RosError: it does not within the time; says why.
        """
        if not self._registration.wait(timeout):
            raise RosError(
                self.problem or f"not registered with {self.master_uri} in {timeout:g} s"
            )

    def close(self) -> None:
        """Sign off at the master and close all sockets, within 5 s; a second call does nothing."""
        with self._lock:
            if self._is_closed:
                return
            self._is_closed = True
        with contextlib.suppress(RosError):
            self._wait(self._registration.leave(), MASTER_SECONDS, "signing off")
        with contextlib.suppress(RosError):
            self._wait(self._shut(), 2.0, "closing the node's sockets")
        self._loop.close()

    def __enter__(self) -> "Node":
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    async def _open(self) -> int:
        loop = asyncio.get_running_loop()
        try:
            found = await loop.getaddrinfo(
                self.host, 0, family=socket.AF_INET, type=socket.SOCK_STREAM
            )
            address = str(found[0][4][0])
            self._listener = Listener(address, self._greet, most=_MOST_CONNECTIONS, loop=self._loop)
            port = await self._api.open(address)
        except OSError as error:
            raise RosError(
                f"cannot listen on {self.host}: {error.strerror or error}; "
                "host must be a name or address of this machine"
            ) from error
        return port

    async def _shut(self) -> None:
        for subscription in self._subscriptions.values():
            subscription.leave()
        self._listener.close()
        await self._api.close()

    async def _greet(self, sock: socket.socket) -> None:
        """Serve one connection: a subscriber's or a service client's."""
        try:
            async with asyncio.timeout(_HANDSHAKE_SECONDS):
                size = length_of(await received(sock, LENGTH), LARGEST_HEADER)
                asked = fields_of(await received(sock, size))
                server = self._publications.get(asked.get("topic", "")) or self._services.get(
                    asked.get("service", "")
                )
                refusal = (
                    f"{self.name} has no topic {asked.get('topic')} and no service "
                    f"{asked.get('service')}"
                    if server is None
                    else server.refusal(asked)
                )
                if refusal:
                    self._refused += 1
                    log.warning("ros_connection_refused", why=refusal, by=asked.get("callerid"))
                    loop = asyncio.get_running_loop()
                    await loop.sock_sendall(sock, header({"error": refusal}))
                    return
            assert server is not None
            await server.serve(sock, asked)
        except (MessageError, TimeoutError) as error:
            self._refused += 1
            log.debug("ros_connection_refused", why=str(error))
        except OSError:
            pass  # the other end went away

    def _methods(self) -> dict[str, Method]:
        """Return the slave API, which the master and other nodes call; on the loop's thread."""
        return {
            "getName": _constant(self.name),
            "getPid": _constant(os.getpid()),
            "getMasterUri": _constant(self.master_uri),
            "getBusInfo": _constant([]),
            "getBusStats": _constant([[], [], []]),
            "getPublications": lambda *_: [1, "", _pairs(self._publications)],
            "getSubscriptions": lambda *_: [1, "", _pairs(self._subscriptions)],
            "paramUpdate": _constant(0),
            "publisherUpdate": self._update,
            "requestTopic": self._offer,
            "shutdown": self._be_shut_down,
        }

    def _update(self, caller: str, topic: str, uris: object) -> list[Any]:
        subscription = self._subscriptions.get(topic)
        if subscription is None:
            return [-1, f"{topic} is not read here", 0]
        subscription.follow(texts_of(uris))
        return [1, "", 0]

    def _offer(self, caller: str, topic: str, protocols: list[list[str]]) -> list[Any]:
        if topic not in self._publications:
            return [-1, f"{topic} is not published here", []]
        if not any(protocol[:1] == ["TCPROS"] for protocol in protocols):
            return [0, "only TCPROS is spoken here", []]
        return [1, "", ["TCPROS", self.host, self._listener.port]]

    def _be_shut_down(self, caller: str, why: str = "") -> list[Any]:
        log.error("ros_node_shut_down", by=caller, why=why)
        self._registration.be_shut_down(str(why))
        return [1, "", 0]

    async def _ask(self, method: str, *arguments: Any) -> Any:
        return await ask(self.master_uri, method, self.name, *arguments)

    def _wait(self, work: Any, seconds: float, what: str) -> Any:
        return self._loop.wait_for(work, seconds, what)


def _check_name(name: str, what: str) -> None:
    if not _NAME.fullmatch(name):
        raise RosError(f"{name!r} cannot name {what} of ROS; expected /letters_and_digits")


def _queue(length: int) -> int:
    if not 1 <= length <= 10_000:
        raise ValueError(f"queue is {length}; allowed are 1 to 10000")
    return length


def _constant(value: Any) -> Method:
    return lambda *_: [1, "", value]


def _pairs(found: dict[str, Publication] | dict[str, Subscription]) -> list[list[str]]:
    return [[one.topic, one.type_name] for one in found.values()]


def _nodes_of(state: Any, topic: str) -> tuple[str, ...]:
    """Return who publishes a topic, of what ``getSystemState`` says."""
    try:
        found = {str(name): tuple(map(str, nodes)) for name, nodes in state[0]}
    except (TypeError, ValueError, IndexError) as error:
        raise RosError(f"the master's state cannot be read: {error}") from error
    return found.get(topic, ())
