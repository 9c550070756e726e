"""A whole run over mutual TLS as a person starts it, with an actor that joins by address alone."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from shared.bus.ports import free_port
from shared.runtime.process import THREAD_LIMITS
from shared.runtime.serve import EXIT_BUS_LOST
from tests.integration.hosts.cluster import RIPOSTE, ROOT, until
from tests.integration.security.secrets import assert_no_secret
from tests.integration.small import SMALL
from tests.integration.training.killing import assert_nothing_lost_nor_counted_twice
from tests.integration.training.training import state_of, training

pytestmark = [pytest.mark.zenoh, pytest.mark.slow, pytest.mark.timeout(400)]


class Site:
    """One machine with certificates, and somebody else's actor."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.run = folder / "run"
        self.endpoint = f"tls/127.0.0.1:{free_port()}"
        self.certificates = folder / "certificates"
        self.site = folder / "site.toml"
        self.site.write_text(
            f"[bus]\nlisten = {json.dumps([self.endpoint])}\n"
            f"certificates = {json.dumps(str(self.certificates))}\n"
        )
        words = ("certs", str(self.certificates), "--host", "127.0.0.1")
        subprocess.run(
            [*RIPOSTE, *words], cwd=ROOT, check=True, stdout=subprocess.DEVNULL, timeout=100
        )
        self.elsewhere = folder / "elsewhere"
        self.elsewhere.mkdir()
        self.theirs = self.elsewhere / "certificates"
        self.theirs.mkdir()
        for name in ("ca.crt", "actor.crt", "actor.key"):  # what a joining machine is given
            (self.theirs / name).write_bytes((self.certificates / name).read_bytes())
        (self.theirs / "actor.key").chmod(0o600)

    def join(self, *words: str) -> "subprocess.Popen[str]":
        """Start an actor as on another machine: three files and an address."""
        return subprocess.Popen(
            [*RIPOSTE, "actor", "--set", "bus.open_seconds=60", *words],
            cwd=self.elsewhere, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
            env=os.environ | THREAD_LIMITS | {"TMPDIR": str(self.elsewhere),
                                              "PYTHONPATH": str(ROOT)},
        )  # fmt: skip


@pytest.fixture
def site(tmp_path: Path) -> Site:
    return Site(tmp_path)


def test_a_run_over_mutual_tls_goes_to_its_end_with_an_actor_that_joins_and_tells_no_key(
    site: Site,
):
    settings = (*SMALL, "train.actors=0", "recorder.live=false")
    with training(site.run, str(site.site), overrides=settings) as run:
        actor = site.join("--connect", site.endpoint, "--certificates", str(site.theirs))
        try:
            found = until(lambda: list(site.elsewhere.glob("riposte-actor-*/logs/*.jsonl")))
            kept = site.run / "logs" / found[0].name
            os.link(found[0], kept)
            out, err = run.communicate(timeout=300)
            assert run.returncode == 0, out + err
            assert actor.wait(60) == 0, actor.communicate()
        finally:
            actor.kill()
            actor.communicate()
    state = state_of(site.run)
    assert state.finished
    assert {lease.grant.actor for lease in state.leases.values()} == {kept.stem}
    assert (site.run / "report.html").exists()
    assert [path.name for path in site.elsewhere.iterdir()] == ["certificates"]
    assert_nothing_lost_nor_counted_twice(site.run)
    assert (site.run / "recording.rrd").exists()
    assert_no_secret([site.certificates], site.run, out + err)


def test_an_actor_without_a_certificate_of_the_site_does_not_join(site: Site):
    settings = (*SMALL, "train.actors=0", "train.record=false")
    stranger = site.elsewhere / "others"
    words = ("certs", str(stranger), "--host", "127.0.0.1")
    subprocess.run([*RIPOSTE, *words], cwd=ROOT, check=True, stdout=subprocess.DEVNULL, timeout=100)
    with training(site.run, str(site.site), overrides=settings):
        until(lambda: (site.run / "endpoint.json").exists())
        until(lambda: '"session_opened"' in _text(site.run / "logs" / "router-0.jsonl"))
        actor = site.join(
            "--connect", site.endpoint, "--certificates", str(stranger), "--set",
            "bus.open_seconds=5",
        )  # fmt: skip
        _, said = actor.communicate(timeout=100)
        assert actor.returncode == EXIT_BUS_LOST, said
        assert "authority" in said
    assert state_of(site.run).leases == {}


def _text(path: Path) -> str:
    return path.read_text() if path.exists() else ""
