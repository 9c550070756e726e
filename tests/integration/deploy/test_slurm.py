"""`actors.sbatch` under a real Slurm of one node: actors join a locked run, and leave it."""

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from shared.runtime.process import end
from tests.integration.deploy.slurm import Slurm, unavailable
from tests.integration.hosts.cluster import RIPOSTE, status, until
from tests.integration.small import SMALL
from tests.integration.training.killing import assert_nothing_lost_nor_counted_twice
from tests.unit.deploy.found import DEPLOY, ROOT

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.timeout(400),
    pytest.mark.skipif(bool(unavailable()), reason=unavailable()),
]
HOST = "127.0.7.47"
"""Of this machine alone: the script's port is always 7447."""
SCRIPT = DEPLOY / "slurm/actors.sbatch"


class Site:
    """A learner host, and a cluster that has the certificates of actors and no more."""

    def __init__(self, folder: Path, slurm: Slurm) -> None:
        self.slurm = slurm
        self.run = folder / "run"
        self._scratch = slurm.folder / "scratch"
        self._scratch.mkdir()
        self._folder = folder
        self._certificates = folder / "certificates"
        subprocess.run([*RIPOSTE, "certs", self._certificates, "--host", HOST], cwd=ROOT,
                       check=True, capture_output=True, timeout=100)  # fmt: skip
        self.actors_files = folder / "actors-files"
        self.actors_files.mkdir()
        for name in ("ca.crt", "actor.crt", "actor.key"):
            shutil.copy(self._certificates / name, self.actors_files)
        text = (DEPLOY / "cluster.toml").read_text().replace("LEARNER", HOST)
        self._site = folder / "cluster.toml"
        self._site.write_text(text.replace('"certificates"', json.dumps(str(self._certificates))))
        self._processes: list[subprocess.Popen[bytes]] = []

    def start(self, *words: str) -> "subprocess.Popen[bytes]":
        """Start a command on the learner host."""
        with (self._folder / "learner.out").open("ab") as output:
            process = subprocess.Popen([*RIPOSTE, words[0], str(self._site), *words[1:]], cwd=ROOT,
                                       stdout=output, stderr=output)  # fmt: skip
        self._processes.append(process)
        return process

    def submit(self, *words: str) -> int:
        """Submit two actors."""
        return self.slurm.submit(
            SCRIPT, "--array=1-2", "--export=ALL", *words,
            RIPOSTE_HOST=HOST, RIPOSTE_CERTIFICATES=str(self.actors_files),
            RIPOSTE_VENV=sys.prefix, PYTHONPATH=str(ROOT), TMPDIR=str(self._scratch),
        )  # fmt: skip

    def actors(self) -> set[str]:
        """Return the names of the actors that `riposte status` shows."""
        found = status(f"tls/{HOST}:7447", self._certificates, "--run-id", "run")
        return {one["name"] for one in found["services"] if one["role"] == "actor"}

    def scratch(self) -> list[Path]:
        """Return the actors' folders."""
        return sorted(self._scratch.glob("riposte-actor-*"))

    def close(self) -> None:
        end(reversed(self._processes), 30.0)


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    folder = Path(tempfile.mkdtemp(prefix="slurm-"))
    try:
        with Slurm(folder) as slurm:
            made = Site(tmp_path, slurm)
            try:
                yield made
            finally:
                made.close()
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def only(site: Site, job: int, state: str) -> bool:
    states = site.slurm.states(job)
    return len(states) == 2 and set(states.values()) == {state}


def test_tasks_join_a_run_and_end_with_it(site: Site):
    settings = (*SMALL, "train.record=false", "train.actors=0")
    overrides = [word for one in settings for word in ("--set", one)]
    run = site.start("train", "--out", str(site.run), *overrides)
    until((site.run / "logs").exists)
    job = site.submit()
    for folder in until(lambda: len(site.scratch()) == 2 and site.scratch()):
        (log,) = until(lambda folder=folder: list(folder.glob("logs/*.jsonl")))
        (site.run / "logs" / log.name).hardlink_to(log)  # its folder goes with the actor
    assert run.wait(200) == 0
    until(lambda: only(site, job, "COMPLETED"))
    assert site.slurm.exit_codes(job) == {"0:0"}, site.slurm.said(job)
    assert site.scratch() == []
    assert_nothing_lost_nor_counted_twice(site.run)


def test_time_that_is_up_and_a_cancelled_job_end_actors_in_order(site: Site):
    site.start("router", "--run", str(site.run))
    site.start("league", "--run", str(site.run))
    short, long = site.submit("--time=1"), site.submit()
    until(lambda: len(site.actors()) == 4)
    site.slurm.cancel(long)
    until(lambda: only(site, long, "CANCELLED"))
    until(lambda: only(site, short, "COMPLETED"), 150.0)  # half a minute before Slurm would kill
    assert site.slurm.exit_codes(short) == {"0:0"}, site.slurm.said(short)
    assert site.scratch() == []


def test_a_cluster_without_the_certificates_is_told_which_file_is_missing(site: Site):
    (site.actors_files / "actor.key").unlink()
    job = site.submit()
    until(lambda: only(site, job, "FAILED"))
    assert site.slurm.exit_codes(job) == {"2:0"}
    wanted = f"cannot read {site.actors_files}/actor.key: copy it from where riposte certs made it"
    assert site.slurm.said(job).splitlines() == [wanted, wanted]
