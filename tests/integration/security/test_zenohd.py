"""Zenoh's own router keeps to the same configuration."""

import shutil
import subprocess
import time
from pathlib import Path

import pytest

from services.jobs.certs.folder import keep
from shared.bus.config import BusConfig, router_json
from shared.bus.ports import free_port
from shared.bus.tls import files_of, why_refused
from shared.messages.topics import ROLES
from tests.integration.security.locked import NOW
from tests.integration.security.test_matrix import expected, probed

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("zenohd") is None,
        reason="needs zenohd on PATH: https://zenoh.io/docs/getting-started/installation",
    ),
]


def test_zenohd_lets_every_role_do_what_the_table_says_and_no_more(tmp_path: Path) -> None:
    certificates = tmp_path / "certificates"
    keep(certificates, [], [], NOW, 10)
    endpoint = f"tls/127.0.0.1:{free_port()}"
    config = tmp_path / "zenohd.json5"
    config.write_text(router_json(BusConfig(listen=(endpoint,), certificates=str(certificates))))
    with subprocess.Popen(["zenohd", "-c", str(config)]) as router:
        try:
            files = files_of(str(certificates), "actor")
            deadline = time.monotonic() + 20
            while why_refused(endpoint, files) and time.monotonic() < deadline:
                time.sleep(0.1)
            assert probed(endpoint, certificates, ROLES) == expected(ROLES)
        finally:
            router.terminate()
