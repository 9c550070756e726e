"""The commands of compose file and manifests, as processes here: jobs over mTLS, measured.

Only places are put in: folders, the router's address, ports. Containers are not tried here, and
`riposte router` stands in for Zenoh's own router of the manifests.
"""

import os
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from services.metrics.families import FAMILIES
from shared.bus.ports import free_port
from shared.runtime.process import end
from shared.runtime.serve import EXIT_BUS_LOST
from tests.integration.small import SMALL
from tests.unit.deploy.found import DEPLOY, KUBERNETES, OWN_IMAGES, ROOT, compose, filled, pods
from tests.unit.metrics.test_exposition import read

pytestmark = [pytest.mark.zenoh, pytest.mark.slow, pytest.mark.timeout(900)]


Commands = dict[str, list[str]]
LASTING = ("league.antagonist_updates=100000",)
"""The run goes on until every metric was seen: actors leave with it, and nobody is to be gone."""


def of_compose() -> Commands:
    return {
        name: service["command"]
        for name, service in compose()["services"].items()
        if service["image"] in OWN_IMAGES
    }


def of_kubernetes() -> Commands:
    router = ["router", "--run", "/var/lib/riposte/run", "--listen", "tls/0.0.0.0:7447",
              "--certificates", "/etc/riposte/certificates"]  # fmt: skip
    made = {"router": router}
    for name, _, spec in pods():
        (container,) = spec["containers"]
        if container["image"] in OWN_IMAGES:
            made[name.removeprefix("riposte-")] = container["args"]
    return made


class Job:
    """What would be started elsewhere, started here."""

    def __init__(self, folder: Path, commands: Commands) -> None:
        self.folder = folder
        self.metrics_port = free_port()
        router = f"tls/127.0.0.1:{free_port()}"
        self._places = {
            "tls/router:7447": router,
            "tls/riposte-router:7447": router,
            "tls/0.0.0.0:7447": router,
            "/etc/riposte/site.toml": str(DEPLOY / "local.toml"),
            "/etc/riposte/site/site.toml": str(folder / "site.toml"),
            "/etc/riposte/certificates": str(folder / "certificates"),
        }
        site = (KUBERNETES / "base/site.toml").read_text()
        (folder / "site.toml").write_text(self._put(site))
        made = subprocess.run(
            [sys.executable, "-m", "services.cli", "certs", folder / "certificates",
             "--host", "127.0.0.1"],
            cwd=ROOT, capture_output=True, text=True, timeout=100, check=False,
        )  # fmt: skip
        assert made.returncode == 0, made.stderr
        self._commands = commands
        self.processes = {name: self._start(name) for name in commands}

    def _put(self, text: str) -> str:
        for place, here in self._places.items():
            text = text.replace(place, here)
        return text

    def _start(self, name: str) -> "subprocess.Popen[bytes]":
        words = [filled(str(word)) for word in self._commands[name]]
        own = str(self.folder / name)
        mine = {"/var/lib/riposte": own, "/tmp/run": f"{own}/run"}
        words = [next((here + word.removeprefix(place) for place, here in mine.items()
                       if word.startswith(place)), self._put(word)) for word in words]  # fmt: skip
        here = (f"metrics.port={self.metrics_port}", "metrics.host='127.0.0.1'")
        settings = (*SMALL, *LASTING, *here, "bus.open_seconds=120")
        if words[0] == "actor":  # the run's settings come from its league
            settings = ("bus.open_seconds=120",)
        words += [word for setting in settings for word in ("--set", setting)]
        temporary = self.folder / name / "tmp"
        temporary.mkdir(parents=True, exist_ok=True)
        with (self.folder / f"{name}.txt").open("ab") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "services.cli", *words], cwd=ROOT, stdout=log, stderr=log,
                env={**os.environ, "TMPDIR": str(temporary)},
            )  # fmt: skip

    def keep_up(self) -> None:
        """Start again what lost the bus, as compose and Kubernetes do; anything else is a fault."""
        for name, process in self.processes.items():
            code = process.poll()
            if code == EXIT_BUS_LOST:
                self.processes[name] = self._start(name)
            elif code is not None:
                said = (self.folder / f"{name}.txt").read_text()[-2000:]
                pytest.fail(f"{name} ended with {code}: {said}")

    def page(self) -> bytes:
        try:
            url = f"http://127.0.0.1:{self.metrics_port}/metrics"
            with urllib.request.urlopen(url, timeout=10) as got:
                return got.read()
        except OSError:
            return b""

    def close(self) -> None:
        end(reversed(self.processes.values()), 30.0)


@pytest.fixture(params=[of_compose, of_kubernetes], ids=["compose", "kubernetes"])
def job(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Job]:
    made = Job(tmp_path, request.param())
    yield made
    made.close()


def test_the_commands_train_and_every_metric_is_measured(job: Job):
    wanted = {family.name for family in FAMILIES}
    seen: set[str] = set()
    roles: set[str] = set()
    samples = 0.0
    deadline = time.monotonic() + 600.0
    while not (wanted <= seen and samples > 0.0):
        job.keep_up()
        assert time.monotonic() < deadline, f"never seen: {sorted(wanted - seen)}, of {roles}"
        for (name, labels), value in read(job.page()).items():
            seen.add(name)
            roles |= {text for key, text in labels if key == "role"}
            if name == "riposte_run_samples_total":
                samples = max(samples, value)
        time.sleep(0.5)
    assert roles >= {"league", "learner", "actor", "metrics"}
    for name in job.processes.keys() - {"router"}:
        alive = subprocess.run(
            [DEPLOY / "docker/riposte-alive", job.folder / name, "30"],
            capture_output=True, text=True, timeout=100, check=False,
        )  # fmt: skip
        assert alive.returncode == 0, f"{name}: {alive.stderr}"
