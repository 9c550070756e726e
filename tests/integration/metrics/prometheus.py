"""Prometheus itself, with the configuration and the rules of `deploy/`, as a process."""

import json
import shutil
import subprocess
import time
import urllib.parse
import urllib.request
from pathlib import Path
from typing import Any, Self

from shared.bus.ports import free_port
from shared.runtime.process import end
from tests.unit.deploy.found import DEPLOY, documents

START_SECONDS = 60.0
EVERY_SECOND = (("scrape_interval: 5s", "scrape_interval: 1s"), ("_interval: 15s", "_interval: 1s"))

missing = "" if shutil.which("prometheus") else "needs prometheus: apt install prometheus"
"""Why it cannot run here; empty when it can."""


class Prometheus:
    """Scrapes one endpoint every second; only places and intervals differ from `deploy/`."""

    def __init__(self, folder: Path, target: int) -> None:
        """Start it.

        Args:
            folder: an empty one, for its files.
            target: port of the metrics on the loopback.
        """
        config = (DEPLOY / "prometheus/prometheus.yml").read_text()
        for there, here in (
            ("metrics:9464", f"127.0.0.1:{target}"),
            ("/etc/prometheus/rules.yml", str(folder / "rules.yml")),
            *EVERY_SECOND,
        ):
            assert there in config
            config = config.replace(there, here)
        (folder / "prometheus.yml").write_text(config)
        rules = (DEPLOY / "prometheus/rules.yml").read_text()
        (folder / "rules.yml").write_text(rules.replace("interval: 15s", "interval: 1s"))
        self._port = free_port()
        self._log = folder / "prometheus.out"
        with self._log.open("wb") as output:
            self._process = subprocess.Popen(
                ["prometheus", f"--config.file={folder / 'prometheus.yml'}",
                 f"--storage.tsdb.path={folder / 'data'}",
                 f"--web.listen-address=127.0.0.1:{self._port}"],
                stdout=output, stderr=output,
            )  # fmt: skip

    def __enter__(self) -> Self:
        deadline = time.monotonic() + START_SECONDS
        while not self._ready():
            assert self._process.poll() is None, self._log.read_text()
            assert time.monotonic() < deadline, self._log.read_text()
            time.sleep(0.1)
        return self

    def __exit__(self, *_: object) -> None:
        end([self._process], 30.0)

    def _ready(self) -> bool:
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{self._port}/-/ready", timeout=5):
                return True
        except OSError:
            return False

    def ask(self, path: str, **parameters: str) -> Any:
        """Return the data of an answer of its HTTP interface."""
        asked = urllib.parse.urlencode(parameters)
        url = f"http://127.0.0.1:{self._port}/api/v1/{path}?{asked}"
        with urllib.request.urlopen(url, timeout=20) as got:
            answer = json.load(got)
        assert answer["status"] == "success", answer
        return answer["data"]

    def query(self, expression: str) -> list[dict[str, Any]]:
        """Return the samples of an expression: their labels (`metric`) and `value`."""
        return self.ask("query", query=expression)["result"]

    def rules(self) -> list[dict[str, Any]]:
        """Return what it knows of every rule: `health`, `lastError`, of an alert its `state`."""
        return [rule for group in self.ask("rules")["groups"] for rule in group["rules"]]


def panels() -> dict[str, list[str]]:
    """Return what the dashboard asks, by panel, for whatever run there is."""
    (board,) = documents(DEPLOY / "grafana/dashboards/riposte.json")
    return {
        panel["title"]: [target["expr"].replace("$run", ".*") for target in panel["targets"]]
        for panel in board["panels"]
        if panel.get("targets")
    }
