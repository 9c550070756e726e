"""A process that takes lease requests and answers those of ``answer``, and nobody else's.

``python -m tests.integration.bus.answerer`` is not how it runs: it is started by its path with
ENDPOINT RUN as arguments, from the root of the repository.
"""

import sys

from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.league import Lease
from shared.messages.topics import LEASE


def main() -> None:
    endpoint, run = sys.argv[1:]
    bus = open_zenoh(BusConfig(connect=(endpoint,)), "league", SystemClock(), run)
    inbox = bus.answer(LEASE)
    bus.declare_alive("league")
    held = []
    while True:
        bus.wait(0.1)
        while (request := inbox.take()) is not None:
            if request.message.actor == "answer":
                request.reply(Lease(lease="here", kind="none"))
            else:
                held.append(request)


if __name__ == "__main__":
    main()
