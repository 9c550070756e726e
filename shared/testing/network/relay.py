"""Delays a TCP connection in user space: ``python -m shared.testing.network.relay HERE THERE S``.

Not the kernel's netem, which delays packets and which many kernels lack: what is delayed here is
the stream of bytes, after the kernel has acknowledged it to its sender. So a round trip takes twice
the delay, while handshakes, retransmissions and congestion windows see the undelayed link.
"""

import asyncio
import contextlib
import sys
from collections.abc import Sequence

CHUNK = 1 << 16
"""Bytes read at a time."""
CHUNKS = 256
"""That may be under way in one direction (16 MiB); then the sender has to wait."""
CONNECT_SECONDS = 5.0

Chunk = tuple[float, bytes]


async def relay(here: str, there: str, delay: float) -> None:
    """Pass everything on, in order and later, until cancelled.

    Args:
        here: ``HOST:PORT`` to listen on.
        there: ``HOST:PORT`` to pass on to.
        delay: one way (s).
    """

    async def on_connection(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError, TimeoutError):  # nobody there: the caller is hung up on
            far = await asyncio.wait_for(
                asyncio.open_connection(*_endpoint(there)), CONNECT_SECONDS
            )
            await asyncio.gather(
                _one_way(reader, far[1], delay),
                _one_way(far[0], writer, delay),
            )
        writer.close()

    server = await asyncio.start_server(on_connection, *_endpoint(here))
    async with server:
        await server.serve_forever()


async def _one_way(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, delay: float
) -> None:
    """Pass on one direction until it ends, then end it on the other side."""
    now = asyncio.get_running_loop().time
    queue: asyncio.Queue[Chunk] = asyncio.Queue(CHUNKS)

    async def read() -> None:
        data = b"?"
        while data:
            try:
                data = await reader.read(CHUNK)
            except OSError:
                data = b""
            await queue.put((now() + delay, data))

    reading = asyncio.create_task(read())
    with contextlib.suppress(OSError):
        while True:
            due_at, data = await queue.get()
            await asyncio.sleep(due_at - now())
            if not data:
                break
            writer.write(data)
            await writer.drain()
    reading.cancel()
    writer.close()


def _endpoint(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    return host, int(port)


def main(argv: Sequence[str]) -> None:
    """Run the relay that the command line asks for."""
    here, there, delay = argv
    asyncio.run(relay(here, there, float(delay)))


if __name__ == "__main__":
    main(sys.argv[1:])
