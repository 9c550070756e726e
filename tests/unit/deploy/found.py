"""What `deploy/` and its documents ask `riposte` to do, as command lines."""

import functools
import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import yaml

ROOT = Path(__file__).resolve().parents[3]
DEPLOY = ROOT / "deploy"
KUBERNETES = DEPLOY / "kubernetes"
OWN_IMAGES = ("riposte-core", "riposte-train")


class Found(NamedTuple):
    """A command line without its program, and where it is."""

    where: str
    words: tuple[str, ...]


@functools.cache
def documents(path: Path) -> list[Any]:
    loaded = yaml.load_all(path.read_text(), getattr(yaml, "CSafeLoader", yaml.SafeLoader))
    return [made for made in loaded if made is not None]


def manifests() -> Iterator[tuple[Path, dict[str, Any]]]:
    for path in sorted(KUBERNETES.rglob("*.yaml")):
        if path.name != "kustomization.yaml":
            for document in documents(path):
                yield path, document


def pods() -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Name of the workload, labels and specification of its pods."""
    for _, document in manifests():
        if document["kind"] in ("StatefulSet", "Deployment"):
            template = document["spec"]["template"]
            yield document["metadata"]["name"], template["metadata"]["labels"], template["spec"]


def compose() -> dict[str, Any]:
    return documents(DEPLOY / "compose.yaml")[0]


def filled(word: str) -> str:
    """A word as it is after its variables were put in, whatever puts them in."""
    word = re.sub(r"\$\{\w+:-([^}]*)\}", r"\1", word)
    word = re.sub(r"\$\(\w+\)|\$\{\w+\}|\$\w+", "run", word)
    return word.replace("%i", "protagonist").replace("%%", "%")


def shell_lines(text: str) -> Iterator[list[str]]:
    """The simple commands of a script that call riposte, words only."""
    for line in text.replace("\\\n", " ").splitlines():
        if re.match(r"\s*(srun .*|sudo )?(\S*/)?riposte\"? ", line):
            words = shlex.split(line, comments=True)
            at = next(k for k, word in enumerate(words) if word.rpartition("/")[2] == "riposte")
            yield words[at + 1 :]


def code_blocks(path: Path) -> str:
    return "\n".join(re.findall(r"(?ms)^```(?:sh|bash|console)?\n(.*?)^```", path.read_text()))


def command_lines() -> list[Found]:
    found: list[Found] = []

    def add(where: str, words: list[Any]) -> None:
        found.append(Found(where, tuple(filled(str(word)) for word in words)))

    for name, _, spec in pods():
        for container in spec["containers"]:
            if container["image"] in OWN_IMAGES:
                add(f"kubernetes {name}", container["args"])
    for name, service in compose()["services"].items():
        if service["image"] in OWN_IMAGES:
            add(f"compose {name}", service["command"])
    for path in sorted((DEPLOY / "systemd").glob("*.service")):
        (line,) = re.findall(r"(?m)^ExecStart=/opt/riposte/bin/riposte (.*)$", path.read_text())
        add(path.name, line.split())
    for words in shell_lines((DEPLOY / "slurm/actors.sbatch").read_text()):
        add("actors.sbatch", words)
    for path in (ROOT / "docs/deploy.md", DEPLOY / "runbook.md"):
        for words in shell_lines(code_blocks(path)):
            add(path.name, words)
    return found


def scripts() -> list[Path]:
    """Every file that a shell runs."""
    return [
        path
        for path in sorted(DEPLOY.rglob("*"))
        if path.is_file() and re.match(rb"#!/bin/(ba)?sh\n", path.read_bytes()[:16])
    ]
