"""A training job across hosts, started as its operator starts it, over mutual TLS."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Self

from shared.bus.config import BusConfig
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.messages.topics import PROGRESS
from shared.runtime.process import THREAD_LIMITS
from shared.testing.network.hosts import Host, Network

ROOT = Path(__file__).resolve().parents[3]
PORT = 7447
RIPOSTE = (sys.executable, "-P", "-m", "services.cli")


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
        patience = ("--set", "bus.open_seconds=120")  # for the router, which starts meanwhile
        return self.start(host, "actor", *where, *patience, *words)

    def status(self, *words: str) -> dict[str, Any]:
        """Return what `riposte status --json` says to the operator, on a machine of the network."""
        return status(self.endpoint, self.certificates, *words)

    def keep_log(self, host: Host) -> Path:
        """Return the log of the actor on a host, kept with the run's own when its folder goes."""
        found = until(lambda: list((self.folder / host.name).glob("riposte-actor-*/logs/*.jsonl")))
        kept = self.run / "logs" / found[0].name
        kept.parent.mkdir(parents=True, exist_ok=True)
        os.link(found[0], kept)
        return kept

    def pace(self) -> "Pace":
        """Return an onlooker that measures the learner's rate."""
        return Pace(self)

    def said(self, host: Host) -> str:
        """Return what the commands on a host have printed."""
        path = self.folder / f"{host.name}.out"
        return path.read_text() if path.exists() else ""


class Pace:
    """An operator who looks at how fast the run goes, by what the league says."""

    def __init__(self, cluster: Cluster) -> None:
        cfg = BusConfig(connect=(cluster.endpoint,), certificates=str(cluster.certificates))
        self.bus = open_zenoh(cfg, "pace", SystemClock(), "run", "operator")
        self._progress = self.bus.subscribe(PROGRESS)
        self._samples = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.bus.close()

    def measure(self, seconds: float) -> float:
        """Return the samples a second that the learner takes in meanwhile."""
        self.rest(1.5, self)
        before, began = self._samples, time.monotonic()
        self.rest(seconds, self)
        return (self._samples - before) / (time.monotonic() - began)

    def until_acknowledged(self, log: Path) -> None:
        """Wait until an actor has had a rollout acknowledged."""
        until(lambda: '"rollout_acknowledged"' in log.read_text())

    def listen(self, timeout: float) -> None:
        self.bus.wait(timeout)
        while (progress := self._progress.take()) is not None:
            self._samples = progress.total_samples

    @staticmethod
    def rest(seconds: float, pace: "Pace | None" = None) -> None:
        """Let time pass, listening."""
        deadline = time.monotonic() + seconds
        while (left := deadline - time.monotonic()) > 0:
            if pace is None:
                time.sleep(left)
            else:
                pace.listen(min(left, 0.2))


class Throttle:
    """Lets a process run for a share of every 200 ms: a slower processor."""

    PERIOD = 0.2

    def __init__(self, process: "subprocess.Popen[bytes]", share: float) -> None:
        self._process = process
        self._on = share * self.PERIOD
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        self._process.send_signal(signal.SIGCONT)

    def _run(self) -> None:
        while not self._over.wait(self._on):
            self._process.send_signal(signal.SIGSTOP)
            self._over.wait(self.PERIOD - self._on)
            self._process.send_signal(signal.SIGCONT)


def status(endpoint: str, certificates: Path, *words: str) -> dict[str, Any]:
    """Return what `riposte status --json` says; no services where it finds none."""
    where = ("--connect", endpoint, "--certificates", str(certificates))
    done = subprocess.run(
        [*RIPOSTE, "status", *where, *words, "--json"], cwd=ROOT, capture_output=True, timeout=60,
        check=False,
    )  # fmt: skip
    return json.loads(done.stdout) if done.returncode == 0 else {"services": []}


def until(condition: Callable[[], Any], seconds: float = 90.0) -> Any:
    """Return the condition's first true value."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        assert time.monotonic() < deadline, f"waited {seconds:g} s in vain"
        time.sleep(0.1)
    return value
