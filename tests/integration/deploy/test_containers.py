"""Both images built, and the compose file's job trained in containers, over mutual TLS."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from services.jobs.runs import state_of
from tests.integration.deploy.containers import (
    UPDATES,
    Composed,
    build,
    composer,
    engine,
    ran,
    unavailable,
)
from tests.integration.hosts.cluster import until
from tests.unit.deploy.found import OWN_IMAGES

pytestmark = [pytest.mark.slow, pytest.mark.zenoh, pytest.mark.timeout(3600)]


@pytest.fixture(scope="module")
def images() -> tuple[str, ...]:
    if why := unavailable():
        pytest.skip(why)
    for image in OWN_IMAGES:
        build(image)
    return OWN_IMAGES


@pytest.fixture
def job(images: tuple[str, ...], tmp_path: Path) -> Iterator[Composed]:
    if not composer():
        pytest.skip("needs docker compose, or podman-compose (apt install podman-compose)")
    with Composed(tmp_path) as made:
        yield made


@pytest.mark.parametrize(("image", "has_torch"), list(zip(OWN_IMAGES, (False, True), strict=True)))
def test_an_image_runs_read_only_as_nobody_in_particular(
    images: tuple[str, ...], image: str, has_torch: bool
):
    alone = (engine(), "run", "--rm", "--read-only", "--network", "none", "--cap-drop", "ALL")
    assert ran(*alone, image, "--version").startswith("riposte ")
    look = "import importlib.util as u, os; print(os.getuid(), u.find_spec('torch') is not None)"
    assert ran(*alone, "--entrypoint", "python", image, "-c", look) == f"10001 {has_torch}"


def test_the_compose_file_trains_to_the_end_though_its_league_is_killed(job: Composed):
    until(lambda: {"league", "learner", "actor"} <= {one["role"] for one in services(job)}, 120.0)
    job.kill("league")
    until(lambda: phase(job) == "finished", 300.0)
    job.inside("router", "riposte-alive", "/var/lib/riposte", "30")
    state = state_of(job.folder / "out/league/run")
    updates = {agent: max(versions) for agent, versions in state.versions.items()}
    assert updates == {"antagonist": UPDATES, "protagonist": 3}
    until(lambda: job.containers()["actor"] == "exited")
    assert "joins run at tls/router:7447" in job.said("actor")


def services(job: Composed) -> list[dict[str, str]]:
    return job.status()["services"]


def phase(job: Composed) -> str:
    progress = job.status().get("progress") or {}
    return progress.get("phase", "")
