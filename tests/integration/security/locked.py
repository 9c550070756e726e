"""A locked site for the tests: certificates made by the code, a router in a process of its own."""

import contextlib
import datetime
import json
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from services.jobs.certs.folder import keep
from services.jobs.certs.making import Pair, certificate_pem, issue, key_pem, read_key
from shared.bus.config import BusConfig, client_json
from shared.bus.ports import free_port

ROOT = Path(__file__).resolve().parents[3]
NOW = datetime.datetime.now(datetime.UTC)
START_SECONDS = 30.0


class Locked:
    """A router that asks for certificates, and the folder they are in."""

    def __init__(self, folder: Path) -> None:
        self.certificates = folder / "certificates"
        keep(self.certificates, [], [], NOW, 30)
        self.port = free_port()
        self.endpoint = f"tls/127.0.0.1:{self.port}"
        self.log = folder / "logs" / "router.jsonl"
        self.output = folder / "router.out"
        with self.output.open("wb") as output:
            self.process = subprocess.Popen(
                [
                    sys.executable, "-m", "services.router", "--name", "router",
                    "--run", str(folder), "--listen", self.endpoint,
                    "--certificates", str(self.certificates),
                ],
                cwd=ROOT, stdout=output, stderr=output,
            )  # fmt: skip
        self._await_open()

    @property
    def cfg(self) -> BusConfig:
        """Return what a client of it is configured with."""
        return BusConfig(
            connect=(self.endpoint,), certificates=str(self.certificates), open_seconds=0.3
        )

    def client(self, role: str, **link: Any) -> str:
        """Return the library's configuration of a client, with other values of its TLS."""
        config = json.loads(client_json(self.cfg, role))  # type: ignore[arg-type]
        tls = config["transport"]["link"]["tls"] | link
        config["transport"]["link"]["tls"] = {k: v for k, v in tls.items() if v is not None}
        config["connect"]["timeout_ms"] = 2000
        return json.dumps(config)

    def issue(
        self, name: str, folder: Path, now: datetime.datetime = NOW, days: int = 30
    ) -> dict[str, str]:
        """Return files of a certificate of the site's authority for any common name."""
        from cryptography import x509

        private = self.certificates / "private" / "ca.key"
        authority = Pair(
            read_key(private.read_bytes()),
            x509.load_pem_x509_certificate((self.certificates / "ca.crt").read_bytes()),
        )
        pair = issue(authority, name, (), now, days)
        certificate, key = folder / f"{name}.crt", folder / f"{name}.key"
        certificate.write_bytes(certificate_pem(pair.certificate))
        key.write_bytes(key_pem(pair.key))
        return {"connect_certificate": str(certificate), "connect_private_key": str(key)}

    def events(self, event: str) -> list[dict[str, Any]]:
        """Return what the router logged under a name."""
        lines = (json.loads(line) for line in self.log.read_text().splitlines())
        return [line for line in lines if line["event"] == event]

    def await_event(self, event: str, seconds: float = 10.0, **values: Any) -> dict[str, Any]:
        """Return a logged event with these values, once it is there."""
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            for line in self.events(event):
                if values.items() <= line.items():
                    return line
            time.sleep(0.05)
        raise AssertionError(f"no {event} with {values}: {self.events(event)}")

    def _await_open(self) -> None:
        deadline = time.monotonic() + START_SECONDS
        while time.monotonic() < deadline:
            assert self.process.poll() is None, self.output.read_text()
            if self.log.exists() and self.events("router_started"):
                return
            time.sleep(0.02)
        raise AssertionError(f"no router within {START_SECONDS} s: {self.output.read_text()}")

    def close(self) -> None:
        """End the router."""
        self.process.terminate()
        self.process.wait(20)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[Locked]:
    """Run a locked router for as long as the block lasts."""
    site = Locked(folder)
    try:
        yield site
    finally:
        site.close()


def greeting(port: int, said: bytes) -> bytes:
    """Return what a port answers to some bytes, empty when it hangs up."""
    with socket.create_connection(("127.0.0.1", port), 2.0) as link:
        link.settimeout(2.0)
        link.sendall(said)
        with contextlib.suppress(ConnectionError):
            return link.recv(100)
    return b""
