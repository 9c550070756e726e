"""The images and the compose file in real containers: Docker's, or podman's."""

import functools
import json
import os
import shutil
import subprocess
from pathlib import Path
from typing import Any, Self

from services.jobs.settings import Settings
from shared.bus.ports import free_port
from tests.integration.hosts.cluster import RIPOSTE, status
from tests.integration.small import SMALL
from tests.unit.deploy.found import DEPLOY, ROOT

BASE = "docker.io/library/python:3.11-slim-bookworm"
BUILD_SECONDS = 1700.0
KILL_CHILDREN = """
import os, pathlib, signal
for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
    if stat.read_text().rpartition(")")[2].split()[1] == "1":
        os.kill(int(stat.parent.name), signal.SIGKILL)
"""
"""The first process of a container is an init, which nobody inside can kill."""
UPDATES = 300
"""Of the antagonist's learner: long enough to be seen at work."""


def ran(*words: str | Path, seconds: float = 100.0, **more: Any) -> str:
    """Return what a command prints; an assertion when it fails."""
    done = subprocess.run(
        words, capture_output=True, text=True, timeout=seconds, check=False, **more
    )
    assert done.returncode == 0, f"{words}: {done.stdout[-2000:]}{done.stderr[-2000:]}"
    return done.stdout.strip()


@functools.cache
def engine() -> str:
    """Return the program that runs containers here; empty when there is none."""
    for name in ("docker", "podman"):
        if shutil.which(name) and _works(name, "info"):
            return name
    return ""


@functools.cache
def composer() -> tuple[str, ...]:
    """Return the program that runs compose files on that engine; empty when there is none."""
    for words in (("docker", "compose"), ("podman-compose",)):
        if engine() == words[0].partition("-")[0] and shutil.which(words[0]):
            return words if _works(*words, "version") else ()
    return ()


def unavailable() -> str:
    """Return why no image can be built here; empty when one can."""
    if not engine():
        return "needs docker and its daemon, or podman (apt install podman)"
    if not _works(engine(), "image", "inspect", BASE) and not _works(engine(), "pull", BASE):
        return f"needs {BASE}: pull it, or make one with tests/integration/deploy/base-image"
    return ""


def _works(*words: str) -> bool:
    done = subprocess.run(words, capture_output=True, timeout=300, check=False)
    return done.returncode == 0


def build(image: str) -> None:
    """Build one of our images, as the compose file names it.

    ``TORCH_INDEX`` of the environment is what the Dockerfile knows by that name.
    """
    index = os.environ.get("TORCH_INDEX")
    words = [] if index is None else ["--build-arg", f"TORCH_INDEX={index}"]
    if engine() == "podman":
        words += ["--format", "docker"]  # the other one has no health checks
    ran(
        engine(), "build", "--network", "host", *words, "-f", DEPLOY / "docker/Dockerfile",
        "--target", image.removeprefix("riposte-"), "-t", image, ROOT, seconds=BUILD_SECONDS,
    )  # fmt: skip


class Composed:
    """The job of the compose file, small, in a folder of its own."""

    def __init__(self, folder: Path) -> None:
        """Make certificates, a site file and the folders that its head asks for."""
        self.folder = folder
        self.port = free_port()
        self._endpoint = f"tls/127.0.0.1:{self.port}"
        text = (DEPLOY / "compose.yaml").read_text()
        published = "${RIPOSTE_LISTEN:-127.0.0.1}:7447:7447"
        assert published in text
        (folder / "compose.yaml").write_text(text.replace(published, f"127.0.0.1:{self.port}:7447"))
        ran(*RIPOSTE, "certs", folder / "certificates", "--host", "router", "--host", "127.0.0.1",
            cwd=ROOT)  # fmt: skip
        site = Settings.load(
            DEPLOY / "local.toml", [*SMALL, f"league.antagonist_updates={UPDATES}"]
        )
        (folder / "site.toml").write_text(site.to_toml())
        for name in ("router", "league", "learner-antagonist", "learner-protagonist", "recorder",
                     "metrics"):  # fmt: skip
            (folder / "out" / name).mkdir(parents=True)
        self._environment = os.environ | {
            "RIPOSTE_UID": str(os.getuid()), "RIPOSTE_GID": str(os.getgid()),
            "RIPOSTE_SITE": "./site.toml", "RIPOSTE_OUT": "./out",
        }  # fmt: skip

    def __enter__(self) -> Self:
        self._compose("up", "-d", "--no-build")
        return self

    def __exit__(self, *_: object) -> None:
        self._compose("down")

    def _compose(self, *words: str) -> str:
        where = ("-f", "compose.yaml", "-p", "riposte-test")
        return ran(*composer(), *where, *words, seconds=300.0, cwd=self.folder,
                   env=self._environment)  # fmt: skip

    def containers(self) -> dict[str, str]:
        """Return the state of each container by the name of its service."""
        said = ran(engine(), "ps", "-a", "--filter", "name=riposte-test", "--format", "json")
        listed = json.loads(said) if said.startswith("[") else map(json.loads, said.splitlines())
        states: dict[str, str] = {}
        for one in listed:
            name = one["Names"] if isinstance(one["Names"], str) else one["Names"][0]
            states[name.removeprefix("riposte-test")[1:-2]] = one["State"]
        return states

    def status(self) -> dict[str, Any]:
        """Return what `riposte status --json` says, from outside of the containers."""
        return status(self._endpoint, self.folder / "certificates", "--run-id", "run")

    def kill(self, service: str) -> None:
        """Kill what runs in a container, as the kernel would: an engine's own kill is a stop."""
        words = (engine(), "exec", self._name(service), "python", "-c", KILL_CHILDREN)
        subprocess.run(words, capture_output=True, timeout=100, check=False)  # it dies with it

    def inside(self, service: str, *words: str) -> str:
        """Return what a command prints in a container."""
        return ran(engine(), "exec", self._name(service), *words)

    def said(self, service: str) -> str:
        """Return what a container has printed."""
        done = subprocess.run(
            [engine(), "logs", self._name(service)], stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, timeout=100, check=True,
        )  # fmt: skip
        return done.stdout

    def _name(self, service: str) -> str:
        listed = ran(engine(), "ps", "-a", "--filter", f"name=riposte-test.{service}.1",
                     "--format", "{{.Names}}")  # fmt: skip
        (name,) = listed.splitlines()
        return name
