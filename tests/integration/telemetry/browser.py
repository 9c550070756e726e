"""A headless Chromium driven over a pipe: no port, no websocket, no further package."""

import base64
import json
import os
import select
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from shared.clock import Clock
from shared.runtime.process import end

FLAGS = (
    "--headless=new",
    "--no-sandbox",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1, EXCLUDE localhost",
    "--remote-debugging-pipe",
)

LAUNCH = """
import os, sys
# The browser reads descriptor 3 and writes descriptor 4, whatever ours are called.
ends = [os.dup(int(end)) for end in sys.argv[1:3]]
spare = [os.open(os.devnull, os.O_RDONLY) for _ in range(8)]
ends = [os.dup(end) for end in ends]
os.dup2(ends[0], 3)
os.dup2(ends[1], 4)
os.execv(sys.argv[3], sys.argv[3:])
"""


def find_chromium() -> str | None:
    """Return the browser's path, None where there is none."""
    names = ("chromium", "chromium-browser", "google-chrome", "chrome")
    return next((path for name in names if (path := shutil.which(name))), None)


class Browser:
    """One page; every wait has a deadline."""

    def __init__(self, program: str, profile: Path, clock: Clock, size: tuple[int, int]) -> None:
        self._clock = clock
        self._number = 0
        self._buffer = b""
        self.events: list[dict[str, Any]] = []
        to_read, self._to = os.pipe()
        self._from, to_write = os.pipe()
        command = [
            program,
            *FLAGS,
            f"--user-data-dir={profile}",
            f"--window-size={size[0]},{size[1]}",
            "about:blank",
        ]
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-c", LAUNCH, str(to_read), str(to_write), *command],
            pass_fds=(to_read, to_write),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        os.close(to_read)
        os.close(to_write)
        page = next(
            target
            for target in self._ask("Target.getTargets")["targetInfos"]
            if target["type"] == "page"
        )
        attached = self._ask("Target.attachToTarget", targetId=page["targetId"], flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.ask(f"{domain}.enable")
        width, height = size
        self.ask(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip

    def ask(self, method: str, **parameters: Any) -> dict[str, Any]:
        return self._ask(method, session=self._session, **parameters)

    def open(self, url: str) -> None:
        self.ask("Page.navigate", url=url)

    def evaluate(self, expression: str) -> Any:
        answer = self.ask("Runtime.evaluate", expression=expression, returnByValue=True)
        return answer["result"].get("value")

    def wait_until(self, check: Callable[[], bool], timeout: float) -> bool:
        until = self._clock.now() + timeout
        while self._clock.now() < until:
            if check():
                return True
            self.listen(0.25)
        return False

    def listen(self, seconds: float) -> None:
        """Take events for a while."""
        until = self._clock.now() + seconds
        while (left := until - self._clock.now()) > 0:
            self._receive(left)

    def screenshot(self, path: Path | None = None, full_page: bool = False) -> bytes:
        answer = self.ask("Page.captureScreenshot", format="png", captureBeyondViewport=full_page)
        image = base64.b64decode(answer["data"])
        if path is not None:
            path.write_bytes(image)
        return image

    def close(self) -> None:
        end([self._process], 5.0)
        os.close(self._to)
        os.close(self._from)

    def _ask(self, method: str, session: str = "", timeout: float = 60.0, **parameters: Any) -> Any:
        self._number += 1
        number = self._number
        request: dict[str, Any] = {"id": number, "method": method, "params": parameters}
        if session:
            request["sessionId"] = session
        os.write(self._to, json.dumps(request).encode() + b"\0")
        until = self._clock.now() + timeout
        while (left := until - self._clock.now()) > 0:
            for message in self._receive(left):
                if message.get("id") == number:
                    if "error" in message:
                        raise RuntimeError(f"{method}: {message['error']}")
                    return message["result"]
        raise TimeoutError(f"the browser did not answer {method} in {timeout} s")

    def _receive(self, timeout: float) -> list[dict[str, Any]]:
        ready, _, _ = select.select([self._from], [], [], timeout)
        if not ready:
            return []
        chunk = os.read(self._from, 1 << 20)
        if not chunk:
            raise RuntimeError("the browser has gone")
        *whole, self._buffer = (self._buffer + chunk).split(b"\0")
        messages = [json.loads(part) for part in whole]
        self.events += [message for message in messages if "method" in message]
        return messages
