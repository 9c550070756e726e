"""What goes wrong between nodes: masters and publishers that go, other types, bytes of no sense."""

import contextlib
import gc
import socket
import threading
import time
import xmlrpc.client
from collections.abc import Callable
from typing import Any

import pytest

from shared.ros import types
from shared.ros.errors import RosError
from shared.ros.node import Node
from shared.ros.wire import fields_of, framed, header
from shared.ros.xmlrpc import place_of
from tests.integration.ros.conftest import Master, eventually

TEXT = "std_msgs/String"
BOOL = "std_msgs/Bool"
Nodes = Callable[..., Node]


def text(data: str) -> Any:
    return types.new(TEXT, data=data)


def tcp_place(node: Node, topic: str) -> tuple[str, int]:
    """Return where a node's topic is served, as the slave API says."""
    with xmlrpc.client.ServerProxy(node.uri) as api:
        code, _, (_, host, port) = api.requestTopic("/test", topic, [["TCPROS"]])  # type: ignore[misc]
    assert code == 1
    return str(host), int(port)  # type: ignore[arg-type]


def said_by(place: tuple[str, int], data: bytes) -> bytes:
    """Return all that is answered to some bytes until the other end closes."""
    reply = b""
    with socket.create_connection(place, timeout=5.0) as sock:
        sock.sendall(data)
        with contextlib.suppress(ConnectionResetError):  # closed with bytes left unread
            while part := sock.recv(4096):
                reply += part
    return reply


def test_the_newest_values_are_kept_and_the_older_ones_counted(nodes: Nodes) -> None:
    writer = nodes("/writer").publish_topic("/t", TEXT, queue=20)
    reader = nodes("/reader").subscribe("/t", TEXT, queue=2)
    eventually(lambda: writer.subscribers)
    for count in range(10):
        writer.publish(text(str(count)))
    eventually(lambda: reader.received == 10)
    found = [reader.take(), reader.take(), reader.take()]
    assert [one and one.message.data for one in found] == ["8", "9", None]
    assert reader.dropped == 8


def test_a_subscriber_that_does_not_read_holds_up_neither_publisher_nor_others(
    nodes: Nodes,
) -> None:
    node = nodes("/writer")
    writer = node.publish_topic("/t", TEXT, queue=2)
    reader = nodes("/reader").subscribe("/t", TEXT, queue=1000)
    eventually(lambda: writer.subscribers)
    with socket.create_connection(tcp_place(node, "/t")) as stuck:
        stuck.sendall(header({"callerid": "/stuck", "topic": "/t", "type": TEXT, "md5sum": "*"}))
        eventually(lambda: len(writer.subscribers) == 2)
        slowest, message = 0.0, text("x" * 10_000)
        for count in range(600):
            began = time.perf_counter()
            writer.publish(message)
            slowest = max(slowest, time.perf_counter() - began)
            eventually(lambda least=count + 1: reader.received >= least)
        assert writer.dropped > 100
    assert slowest < 2.0  # one that waited would have waited until the stuck one was given up
    eventually(lambda: writer.subscribers == ("/reader",))


def test_another_type_is_refused_on_both_sides_and_said(nodes: Nodes) -> None:
    writer = nodes("/writer").publish_topic("/t", BOOL)
    reader = nodes("/reader").subscribe("/t", TEXT)
    eventually(lambda: "md5sum" in reader.problem)
    assert "std_msgs/Bool" in reader.problem
    assert not writer.subscribers
    assert reader.received == 0
    with pytest.raises(ValueError, match="carries std_msgs/Bool"):
        writer.publish(text("no"))


def test_everything_is_registered_again_when_the_master_has_restarted(
    nodes: Nodes, master: Master
) -> None:
    first, second = nodes("/first"), nodes("/second")
    writer = first.publish_topic("/t", TEXT)
    first.serve("/s", "std_srvs/Empty", lambda _: types.new("std_srvs/EmptyResponse"))
    early = second.subscribe("/t", TEXT, queue=5)
    eventually(lambda: writer.subscribers)
    first.wait_registered(5.0)
    master.stop()
    eventually(lambda: "no ROS master at" in first.problem and not first.is_registered)
    writer.publish(text("without a master"))
    assert early.wait(2.0)  # what is connected goes on
    master.start()
    first.wait_registered(10.0)
    assert first.problem == ""
    third = nodes("/third")
    late = third.subscribe("/t", TEXT)
    eventually(lambda: len(writer.subscribers) == 2)
    writer.publish(text("again"))
    assert late.wait(2.0)
    third.call("/s", "std_srvs/Empty", types.new("std_srvs/EmptyRequest"), 2.0)


def test_a_publisher_that_dies_is_followed_by_its_successor(nodes: Nodes, master: Master) -> None:
    reader = nodes("/reader").subscribe("/t", TEXT)
    for life in ("first", "second"):
        with Node("/writer", master.uri, host="127.0.0.1") as writer:
            topic = writer.publish_topic("/t", TEXT, latch=True)
            topic.publish(text(life))
            assert reader.wait(5.0)
            found = reader.take()
            assert found is not None
            assert found.message.data == life
        eventually(lambda: not reader.publishers)


def test_no_master_is_said_and_is_no_error_until_something_is_asked() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        uri = f"http://127.0.0.1:{taken.getsockname()[1]}"
    with Node("/lonely", uri) as node:
        reader = node.subscribe("/t", TEXT)
        eventually(lambda: "no ROS master" in node.problem)
        with pytest.raises(RosError, match=r"no ROS master at http://127\.0\.0\.1.*robot on"):
            node.wait_registered(0.1)
        with pytest.raises(RosError, match="does not answer"):
            node.param("/x")
        assert reader.take() is None


def test_an_address_that_cannot_be_is_one_line() -> None:
    with pytest.raises(RosError, match="expected http://host:port"):
        Node("/x", "no address")
    with pytest.raises(RosError, match="cannot name a node"):
        Node("x y", "http://127.0.0.1:1")
    with pytest.raises(RosError, match="host must be a name or address of this machine"):
        Node("/x", "http://127.0.0.1:1", host="203.0.113.1")


def test_a_master_that_accepts_and_never_answers_costs_its_deadline_only() -> None:
    with socket.create_server(("127.0.0.1", 0)) as silent:
        with Node("/waiting", f"http://127.0.0.1:{silent.getsockname()[1]}") as node:
            began = time.monotonic()
            with pytest.raises(RosError, match=r"no answer within 0\.3 s"):
                node.param("/x", timeout=0.3)
            assert time.monotonic() - began < 1.0
            began = time.monotonic()
        assert time.monotonic() - began < 5.0


def test_garbage_on_a_nodes_port_ends_that_connection_only(nodes: Nodes) -> None:
    node = nodes("/writer")
    writer = node.publish_topic("/t", TEXT)
    reader = nodes("/reader").subscribe("/t", TEXT)
    eventually(lambda: writer.subscribers)
    place = tcp_place(node, "/t")
    for nonsense in (
        b"GET / HTTP/1.1\r\n\r\n",
        b"\xff\xff\xff\xff" + b"x" * 100,
        framed(b"\x05\x00\x00\x00no"),
        framed(framed(b"nothing that has a value")),
    ):
        assert said_by(place, nonsense) == b""
    for asked in ({"topic": "/unknown", "md5sum": "*"}, {"topic": "/t", "md5sum": "0" * 32}):
        reply = said_by(place, header(asked))
        assert asked["topic"] in fields_of(reply[4:])["error"]
    assert node.refused == 6
    for nonsense in (
        b"\x00" * 50 + b"\r\n\r\n",
        b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n",
    ):
        assert said_by(place_of(node.uri), nonsense) == b""
    writer.publish(text("still here"))
    assert reader.wait(2.0)


class Impostor:
    """A publisher at the master that sends what it likes after its header."""

    def __init__(self, node: Node, topic: str, *parts: bytes, md5: str = "") -> None:
        # The slave API of a real node, the TCPROS server of our own.
        self._server = socket.create_server(("127.0.0.1", 0))
        port = self._server.getsockname()[1]
        node._listener.port = port  # pyright: ignore[reportPrivateUsage]
        self._md5 = md5 or types.md5_of(TEXT)
        self._parts = parts
        self._topic = topic
        self.connections = 0
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        while True:
            try:
                sock, _ = self._server.accept()
            except OSError:
                return
            with sock:
                self.connections += 1
                sock.recv(65536)
                sock.sendall(header({"md5sum": self._md5, "type": TEXT, "topic": self._topic}))
                for part in self._parts:
                    sock.sendall(part)
                time.sleep(0.05)

    def close(self) -> None:
        self._server.close()


def test_what_a_publisher_sends_is_checked_before_it_is_used(nodes: Nodes) -> None:
    good = framed(types.write(text("good")))
    node = nodes("/impostor")
    node.publish_topic("/t", TEXT)
    impostor = Impostor(
        node, "/t",
        framed(b"\xff\xff\xff\x7fno text is so long"),  # malformed
        good,
        b"\xff\xff\xff\x7f" + b"x" * 100,  # oversize: the end of the connection
    )  # fmt: skip
    reader = nodes("/reader", largest_message=1000).subscribe("/t", TEXT, queue=10)
    found = eventually(reader.take)
    assert found.message.data == "good"
    eventually(lambda: impostor.connections >= 2)  # it tries again
    assert reader.malformed >= 2
    impostor.close()


def test_an_impostor_of_another_type_is_not_listened_to(nodes: Nodes) -> None:
    node = nodes("/impostor")
    node.publish_topic("/t", TEXT)
    impostor = Impostor(node, "/t", framed(types.write(text("bad"))), md5="0" * 32)
    reader = nodes("/reader").subscribe("/t", TEXT)
    eventually(lambda: "is its ROS package another version" in reader.problem)
    assert reader.received == 0
    impostor.close()


def test_services_that_fail_are_absent_or_slow_are_said(nodes: Nodes, master: Master) -> None:
    node, other = nodes("/server"), nodes("/client")
    asked = types.new("std_srvs/SetBoolRequest")

    def broken(_: Any) -> Any:
        raise RuntimeError("out of order")

    def slow(_: Any) -> Any:
        time.sleep(0.5)
        return types.new("std_srvs/SetBoolResponse")

    node.serve("/broken", "std_srvs/SetBool", broken)
    node.serve("/slow", "std_srvs/SetBool", slow)
    node.wait_registered(5.0)
    with pytest.raises(RosError, match="failed: out of order"):
        other.call("/broken", "std_srvs/SetBool", asked, 2.0)
    with pytest.raises(RosError, match=r"no answer within 0\.1 s"):
        other.call("/slow", "std_srvs/SetBool", asked, 0.1)
    with pytest.raises(RosError, match="refuses lookupService"):
        other.call("/absent", "std_srvs/SetBool", asked, 2.0)
    with pytest.raises(RosError, match="md5sum"):
        other.call("/broken", "std_srvs/Trigger", types.new("std_srvs/TriggerRequest"), 2.0)
    # what was called before is found without the master
    master.stop()
    with pytest.raises(RosError, match="failed: out of order"):
        other.call("/broken", "std_srvs/SetBool", asked, 2.0)


def test_parameters_are_set_read_and_absent(nodes: Nodes) -> None:
    node = nodes("/ours")
    node.set_param("/r_cart/cart_gains/trans", {"p": 800.0, "d": 15.0})
    assert node.param("/r_cart") == {"cart_gains": {"trans": {"p": 800.0, "d": 15.0}}}
    assert node.param("/absent") is None
    assert node.param("/absent", 1.0) == 1.0


def test_a_second_node_of_the_name_ends_the_first_and_closing_signs_off(
    nodes: Nodes, master: Master
) -> None:
    first = nodes("/same")
    first.publish_topic("/t", TEXT)
    first.wait_registered(5.0)
    second = Node("/same", master.uri)
    second.publish_topic("/t", TEXT)
    second.wait_registered(5.0)
    eventually(lambda: first.is_shut_down)
    assert "another node of this name" in first.problem
    assert second.publishers_of("/t") == ("/same",)
    second.close()
    second.close()
    with pytest.raises(RosError, match="closed"):
        second.param("/x")
    assert nodes("/other").publishers_of("/t") == ()


def test_a_closed_node_leaves_no_thread(master: Master) -> None:
    before = set(threading.enumerate())
    node = Node("/short", master.uri)
    node.serve("/s", "std_srvs/Empty", lambda _: types.new("std_srvs/EmptyResponse"))
    node.wait_registered(5.0)
    node.call("/s", "std_srvs/Empty", types.new("std_srvs/EmptyRequest"), 2.0)
    ours = {one.name for one in set(threading.enumerate()) - before if "short" in one.name}
    assert 1 <= len(ours) <= 5
    node.close()
    eventually(lambda: not [one for one in threading.enumerate() if "short" in one.name])


def test_a_node_that_closes_lets_go_of_those_who_are_just_asking_it(master: Master) -> None:
    node = Node("/asked", master.uri, "127.0.0.1")
    place = place_of(node.uri)
    asking = [socket.create_connection(place, 2.0) for _ in range(3)]
    asking[0].sendall(b"POST /RPC2 HTTP/1.1\r\n")  # and nothing more
    time.sleep(0.1)
    node.close()
    gc.collect()  # an unfinished task would be an error of this test
    for one in asking:
        one.settimeout(2.0)
        with contextlib.suppress(ConnectionResetError):
            assert one.recv(1) == b""
        one.close()
