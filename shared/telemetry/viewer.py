"""The Rerun web viewer, served on the loopback by the program that comes with Rerun.

The library's own ``serve_web_viewer`` listens on every interface and cannot be told otherwise.
"""

import socket
import subprocess
import threading
import urllib.parse
from collections.abc import Sequence
from importlib import util
from pathlib import Path

from shared.bus.ports import LOOPBACK, free_port
from shared.errors import RiposteError


def page_url(web_port: int, sources: Sequence[str]) -> str:
    """Return the address of the page that shows what ``sources`` serve, merged."""
    query = urllib.parse.urlencode([("url", source) for source in sources])
    return f"http://{LOOPBACK}:{web_port}/?{query}"


class WebViewer:
    """A child process that serves the viewer's page, and recordings from disk if asked to."""

    def __init__(
        self,
        sources: Sequence[str],
        web_port: int = 0,
        launcher: Sequence[str] = (),
    ) -> None:
        """Start it.

        Args:
            sources: ``rerun+http://`` addresses, or paths of ``.rrd`` files (never mixed).
            web_port: port of the page, another one where it is taken; 0 for any.
            launcher: command that becomes the program, to have it die with its parent.

        Raises:
            RiposteError: Rerun's program is missing or cannot be started.
        """
        self.web_port = free_port(web_port)
        files = not all(source.startswith("rerun+") for source in sources)
        grpc_port = free_port()
        command = [
            *launcher, str(viewer_program()), *sources, "--serve-web", "--bind", LOOPBACK,
            "--web-viewer-port", str(self.web_port), "--port", str(grpc_port),
        ]  # fmt: skip
        shown = [f"rerun+http://{LOOPBACK}:{grpc_port}/proxy"] if files else sources
        self.url = page_url(self.web_port, shown)
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
        except OSError as error:
            raise RiposteError(f"cannot start Rerun's viewer ({command[0]}): {error}") from error

    @property
    def pid(self) -> int:
        """Return the child's process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Return whether the child still runs."""
        return self._process.poll() is None

    def wait_ready(self, timeout: float = 10.0) -> bool:
        """Wait until the page can be fetched; return whether it can."""
        pause = threading.Event()
        for _ in range(max(1, round(timeout / 0.05))):
            if not self.alive:
                return False
            with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
                if probe.connect_ex((LOOPBACK, self.web_port)) == 0:
                    return True
            pause.wait(0.05)
        return False

    def wait(self) -> int:
        """Wait until the child ends."""
        return self._process.wait()

    def close(self, timeout: float = 3.0) -> None:
        """End it."""
        if self.alive:
            self._process.terminate()
            try:
                self._process.wait(timeout)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait(timeout)


def viewer_program() -> Path:
    """Return the program that comes with Rerun.

    Raises:
        RiposteError: it is not there.
    """
    spec = util.find_spec("rerun_cli")
    for folder in (spec.submodule_search_locations or []) if spec is not None else []:
        for name in ("rerun", "rerun.exe"):
            if (path := Path(folder) / name).exists():
                return path
    raise RiposteError("Rerun's viewer is not installed; reinstall rerun-sdk from a wheel")
