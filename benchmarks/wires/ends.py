"""Both ends of a connection: messages of a fixed size one way, a byte for each the other way.

``python -m benchmarks.wires.ends KIND --receive --size BYTES`` prints its port and takes what
comes; ``--send PORT --rounds N`` prints JSON: wall seconds, and CPU seconds of this process.
At most `WINDOW` messages are on their way. Its packages: `benchmarks/requirements/wires.txt`.
"""
# pyright: basic

import argparse
import json
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent import futures

WINDOW = 4
"""As in `benchmarks.throughput`."""
HOST = "127.0.0.1"
PATIENCE = 60.0
WARM_UP = 8

Figures = dict[str, float]


def receive_tcp(size: int) -> None:
    """Acknowledge every ``size`` bytes of one connection."""
    buffer = memoryview(bytearray(size))
    with socket.create_server((HOST, 0)) as server:
        print(server.getsockname()[1], flush=True)
        link, _ = server.accept()
        with link:
            while True:
                at = 0
                while at < size:
                    got = link.recv_into(buffer[at:])
                    if not got:
                        return
                    at += got
                link.sendall(b"k")


def send_tcp(port: int, payload: bytes, rounds: int) -> Figures:
    """Send through a bare socket."""
    with socket.create_connection((HOST, port), timeout=PATIENCE) as link:
        return _timed(rounds, _windowed(lambda: link.sendall(payload), lambda: link.recv(1)))


def receive_zeromq(size: int) -> None:
    """Acknowledge every message."""
    import zmq

    server = zmq.Context.instance().socket(zmq.PAIR)
    print(server.bind_to_random_port(f"tcp://{HOST}"), flush=True)
    while True:
        if len(server.recv()) != size:
            raise SystemExit("a message of another size")
        server.send(b"k")


def send_zeromq(port: int, payload: bytes, rounds: int) -> Figures:
    """Send through ZeroMQ, a pair of sockets over TCP."""
    import zmq

    with zmq.Context.instance().socket(zmq.PAIR) as link:
        link.setsockopt(zmq.RCVTIMEO, int(1e3 * PATIENCE))
        link.connect(f"tcp://{HOST}:{port}")
        return _timed(rounds, _windowed(lambda: link.send(payload), link.recv))


_OPTIONS = [("grpc.max_receive_message_length", 1 << 26)]


def receive_grpc(size: int) -> None:
    """Acknowledge every message of a stream both ways; bytes as they are, no protobuf."""
    import grpc

    def take(requests: Iterator[bytes], _context: object) -> Iterator[bytes]:
        for request in requests:
            if len(request) != size:
                raise SystemExit("a message of another size")
            yield b"k"

    handler = grpc.method_handlers_generic_handler(
        "riposte", {"Send": grpc.stream_stream_rpc_method_handler(take)}
    )
    server = grpc.server(futures.ThreadPoolExecutor(1), options=_OPTIONS)
    server.add_generic_rpc_handlers((handler,))
    print(server.add_insecure_port(f"{HOST}:0"), flush=True)
    server.start()
    server.wait_for_termination()


def send_grpc(port: int, payload: bytes, rounds: int) -> Figures:
    """Send through gRPC, one stream both ways."""
    import grpc

    with grpc.insecure_channel(f"{HOST}:{port}", options=_OPTIONS) as channel:

        def transfer(messages: int) -> None:
            room = threading.Semaphore(WINDOW)

            def requests() -> Iterator[bytes]:
                for _ in range(messages):
                    room.acquire(timeout=PATIENCE)
                    yield payload

            for _ in channel.stream_stream("/riposte/Send")(requests(), timeout=PATIENCE):
                room.release()

        return _timed(rounds, transfer)


def _windowed(
    send: Callable[[], object], acknowledged: Callable[[], object]
) -> Callable[[int], None]:
    """Return what sends so many messages, few of them under way at a time."""

    def transfer(messages: int) -> None:
        for number in range(messages):
            if number >= WINDOW:
                acknowledged()
            send()
        for _ in range(min(messages, WINDOW)):
            acknowledged()

    return transfer


def _timed(rounds: int, transfer: Callable[[int], None]) -> Figures:
    transfer(WARM_UP)
    wall, cpu = time.perf_counter(), time.process_time()
    transfer(rounds)
    return {"wall_s": time.perf_counter() - wall, "cpu_s": time.process_time() - cpu}


KINDS = {
    "tcp": (receive_tcp, send_tcp),
    "zeromq": (receive_zeromq, send_zeromq),
    "grpc": (receive_grpc, send_grpc),
}


def main() -> None:
    """Be one of the two ends."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kind", choices=KINDS)
    parser.add_argument("--size", type=int, required=True, metavar="BYTES")
    parser.add_argument("--receive", action="store_true")
    parser.add_argument("--send", type=int, metavar="PORT")
    parser.add_argument("--rounds", type=int, default=100)
    found = parser.parse_args()
    receive, send = KINDS[found.kind]
    if found.receive:
        receive(found.size)
        return
    json.dump(send(found.send, bytes(found.size), found.rounds), sys.stdout)


if __name__ == "__main__":
    main()
