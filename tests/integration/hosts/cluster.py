"""A training job across hosts, started as its operator starts it, over mutual TLS."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from shared.runtime.process import THREAD_LIMITS
from shared.testing.network.hosts import Host, Network

ROOT = Path(__file__).resolve().parents[3]
PORT = 7447
RIPOSTE = (sys.executable, "-P", "-m", "services.cli")
END_SECONDS = 60.0


class Cluster:
    """A host that learns, and others."""

    def __init__(self, network: Network, folder: Path) -> None:
        """Make the learner host, the certificates of the site and its site file."""
        self.network = network
        self.folder = folder
        self.run = folder / "run"
        self.learner = network.host("learner")
        self.endpoint = f"tls/{self.learner.address}:{PORT}"
        self.certificates = folder / "certificates"
        words = ("certs", str(self.certificates), "--host", self.learner.address)
        subprocess.run([*RIPOSTE, *words], check=True, stdout=subprocess.DEVNULL)
        text = (ROOT / "deploy" / "cluster.toml").read_text()
        text = text.replace("LEARNER", self.learner.address)
        text = text.replace('"certificates"', json.dumps(str(self.certificates)))
        self.site = folder / "cluster.toml"
        self.site.write_text(text)

    def start(self, host: Host, *words: str) -> "subprocess.Popen[bytes]":
        """Run a `riposte` command on a host, in a working directory and a TMPDIR of its own."""
        home = self.folder / host.name
        home.mkdir(exist_ok=True)
        with (self.folder / f"{host.name}.out").open("ab") as output:
            return host.start(
                *RIPOSTE, *words, stdout=output, stderr=output, cwd=home,
                env=os.environ | THREAD_LIMITS | {"TMPDIR": str(home), "PYTHONPATH": str(ROOT)},
            )  # fmt: skip

    def train(self, overrides: Sequence[str]) -> "subprocess.Popen[bytes]":
        """Start the run on the learner host."""
        settings = [word for one in overrides for word in ("--set", one)]
        return self.start(self.learner, "train", str(self.site), "--out", str(self.run), *settings)

    def join(self, host: Host, *words: str) -> "subprocess.Popen[bytes]":
        """Start an actor on a host, which knows an address and has its certificate."""
        where = ("--connect", self.endpoint, "--certificates", str(self.certificates))
        return self.start(host, "actor", *where, *words)

    def status(self, *words: str) -> dict[str, Any]:
        """Return what `riposte status --json` says to the operator, on a machine of the network."""
        where = ("--connect", self.endpoint, "--certificates", str(self.certificates))
        done = subprocess.run(
            [*RIPOSTE, "status", *where, *words, "--json"], capture_output=True, timeout=60,
        )  # fmt: skip
        return json.loads(done.stdout) if done.returncode == 0 else {"services": []}

    def said(self, host: Host) -> str:
        """Return what the commands on a host have printed."""
        path = self.folder / f"{host.name}.out"
        return path.read_text() if path.exists() else ""


def until(condition: Callable[[], Any], seconds: float = 90.0) -> Any:
    """Return the condition's first true value."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < deadline, f"waited {seconds:g} s in vain"
        time.sleep(0.1)
    return value
