"""A ROS 1 master in this process: Debian's own, on the loopback."""

import contextlib
import importlib
import os
import socket
import sys
import threading
import time
import warnings
import weakref
import xmlrpc.client
from pathlib import Path
from typing import Any, Final

from shared.bus.ports import LOOPBACK, free_port
from shared.errors import ConfigError

DEBIAN: Final = "/usr/lib/python3/dist-packages"
"""Where python3-rosmaster is installed; at the end of the path, so that it hides nothing."""
_START_SECONDS: Final = 5.0


def has_ros_master() -> bool:
    """Return whether Debian's package is installed."""
    return Path(DEBIAN, "rosmaster").is_dir()


class _Closed(xmlrpc.client.ServerProxy):
    """Closes its connection when nobody has it any more; the master's threads leave theirs open."""

    def __init__(self, uri: str) -> None:
        super().__init__(uri)
        weakref.finalize(self, self("transport").close)


class RosMaster:
    """Runs until it is closed."""

    def __init__(self, port: int = 0, host: str = LOOPBACK) -> None:
        """Start it.

        Args:
            port: 0 takes a free one.
            host: address of this machine at which it is to be reached.

        Raises:
            ConfigError: the package is not installed, or the port is taken.
        """
        if not has_ros_master():
            raise ConfigError("there is no ROS master here: apt install python3-rosmaster")
        if port and free_port(port) != port:
            raise ConfigError(
                f"port {port} is taken: is another ROS master running? Give another port, or 0"
            )
        if DEBIAN not in sys.path:
            sys.path.append(DEBIAN)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # it is older than Python 3.10
            handler: Any = importlib.import_module("rosmaster.master_api").ROSMasterHandler()
        make: Any = importlib.import_module("rosgraph.xmlrpc").XmlRpcNode
        util: Any = importlib.import_module("rosmaster.util")
        util.ServerProxy = _Closed
        self._node: Any = make(port, handler, _leave)
        before = os.environ.get("ROS_IP")
        os.environ["ROS_IP"] = host  # the one way to tell it where to listen
        try:
            self._node.start()
            self._wait()
        finally:
            if before is None:
                del os.environ["ROS_IP"]
            else:
                os.environ["ROS_IP"] = before
        self.uri = f"http://{host}:{self._node.port}"
        """What a node takes as ROS_MASTER_URI."""

    def close(self) -> None:
        """Stop it; a second call does nothing."""
        if self._node is not None:
            node, self._node = self._node, None
            node.is_shutdown = True
            # Its loop must end before its socket goes; a caller wakes it.
            ending = threading.Thread(target=node.server.shutdown)
            ending.start()
            with contextlib.suppress(OSError):
                socket.create_connection(node.server.server_address, 1.0).close()
            ending.join()
            node.shutdown("closed")

    def _wait(self) -> None:
        deadline = time.monotonic() + _START_SECONDS
        while not self._node.uri:
            if time.monotonic() > deadline:
                raise ConfigError(f"the ROS master did not start within {_START_SECONDS:g} s")
            time.sleep(0.001)


def _leave(error: Exception) -> None:
    """Take what ended the master's loop; whoever waits for it says so."""
    del error
