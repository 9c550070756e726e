"""TCP ports of the loopback."""

import socket

from shared.errors import RiposteError

LOOPBACK = "127.0.0.1"


def free_port(wanted: int = 0) -> int:
    """Return ``wanted`` where it is free on the loopback, else another port that is free now."""
    for port in (wanted, 0):
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((LOOPBACK, port))
            except OSError:
                continue
            return probe.getsockname()[1]
    raise RiposteError(f"no free port on {LOOPBACK}; close something that listens there")
