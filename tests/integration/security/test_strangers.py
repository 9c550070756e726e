"""Who gets no session at all, what passes no router, and that no secret is ever written down."""

import contextlib
import datetime
import json
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest
import zenoh

from services.jobs.certs.folder import keep
from services.jobs.status import main as status
from shared.bus.config import MAX_MESSAGE, BusConfig
from shared.bus.tls import files_of, why_refused
from shared.bus.zenoh import open_zenoh
from shared.clock import SystemClock
from shared.errors import BusError
from shared.messages.topics import BATS
from shared.runtime.serve import EXIT_BUS_LOST
from tests.integration.security.locked import NOW, ROOT, Locked, greeting
from tests.integration.security.secrets import assert_no_secret

pytestmark = pytest.mark.zenoh
BATS_KEY = "riposte/v1/probe/play/bats"


def session(config: str) -> contextlib.closing[zenoh.Session]:
    return contextlib.closing(zenoh.open(zenoh.Config.from_json5(config)))


def refusal(cfg: BusConfig) -> str:
    """Return what a service says that gets no session."""
    with pytest.raises(BusError) as caught:
        open_zenoh(cfg, "actor-0", SystemClock(), "run", "actor").close()
    return str(caught.value)


def test_without_a_certificate_there_is_no_session(site: Locked) -> None:
    config = site.client(
        "actor", connect_certificate=None, connect_private_key=None, enable_mtls=False
    )
    with pytest.raises(zenoh.ZError):
        zenoh.open(zenoh.Config.from_json5(config))
    site.await_event("connection_refused", reason="peer sent no certificates")


def test_a_certificate_of_another_authority_is_refused_and_the_error_says_so(
    site: Locked, tmp_path: Path
) -> None:
    keep(tmp_path / "other", [], [], NOW, 10)
    cfg = BusConfig(
        connect=(site.endpoint,), certificates=str(tmp_path / "other"), open_seconds=0.3
    )
    said = refusal(cfg)  # it does not trust the router, either
    assert "not of the authority of actor.crt" in said
    shutil.copy(site.certificates / "ca.crt", tmp_path / "other" / "ca.crt")
    said = refusal(cfg)
    assert "refused actor.crt" in said
    assert "riposte certs" in said
    assert "PRIVATE KEY" not in said
    site.await_event("connection_refused")


def test_a_certificate_that_has_expired_is_refused(site: Locked, tmp_path: Path) -> None:
    long_ago = NOW - datetime.timedelta(days=20)
    config = site.client("actor", **site.issue("actor", tmp_path, long_ago, 10))
    with pytest.raises(zenoh.ZError):
        zenoh.open(zenoh.Config.from_json5(config))
    deadline = time.monotonic() + 10
    while time.monotonic() < deadline:
        if any("expired" in line["reason"] for line in site.events("connection_refused")):
            return
        time.sleep(0.05)
    raise AssertionError(site.events("connection_refused"))


def test_a_certificate_that_expires_takes_its_open_session_with_it(
    site: Locked, tmp_path: Path
) -> None:
    soon = datetime.datetime.now(datetime.UTC) - datetime.timedelta(days=10, seconds=-4)
    files = site.issue("actor", tmp_path, soon, 10)
    careless = site.client("actor", **files, close_link_on_expiration=False)
    with session(careless) as guest, session(site.client("actor")) as witness:
        assert list(guest.info.routers_zid())
        deadline = time.monotonic() + 15
        while list(guest.info.routers_zid()) and time.monotonic() < deadline:
            time.sleep(0.1)
        assert not list(guest.info.routers_zid())
        assert list(witness.info.routers_zid())


def test_a_router_under_a_name_its_certificate_lacks_is_not_trusted(site: Locked) -> None:
    endpoint = f"tls/127.0.0.9:{site.port}"  # nobody listens there; the router is on 127.0.0.1
    said = why_refused(endpoint, files_of(str(site.certificates), "actor"))
    assert said == "Connection refused"
    with forwarded(site.port) as port:
        endpoint = f"tls/127.0.0.9:{port}"
        cfg = BusConfig(connect=(endpoint,), certificates=str(site.certificates), open_seconds=0.3)
        said = refusal(cfg)
    assert "not for 127.0.0.9" in said
    assert "--host" in said


@contextlib.contextmanager
def forwarded(port: int):
    """Yield a port of 127.0.0.9 behind which is a port of 127.0.0.1."""
    code = (
        "import socket,sys,threading\n"
        "s=socket.create_server(('127.0.0.9',0)); print(s.getsockname()[1],flush=True)\n"
        "def pump(a,b):\n"
        "    try:\n"
        "        while data:=a.recv(65536): b.sendall(data)\n"
        "    except OSError: pass\n"
        "    b.close()\n"
        "while True:\n"
        "    a,_=s.accept(); b=socket.create_connection(('127.0.0.1',int(sys.argv[1])))\n"
        "    for x,y in ((a,b),(b,a)):\n"
        "        threading.Thread(target=pump,args=(x,y),daemon=True).start()\n"
    )
    with subprocess.Popen([sys.executable, "-c", code, str(port)], stdout=subprocess.PIPE) as pump:
        assert pump.stdout is not None
        try:
            yield int(pump.stdout.readline())
        finally:
            pump.kill()


def test_plain_words_at_the_encrypted_port_get_no_answer_and_the_router_goes_on(
    site: Locked,
) -> None:
    assert not greeting(site.port, b"\x05\x00hello zenoh\n" * 20).startswith(b"\x05")
    cfg = BusConfig(connect=(site.endpoint.replace("tls/", "tcp/"),), open_seconds=0.3)
    assert refusal(cfg).startswith("no router at tcp/")
    assert why_refused(site.endpoint, files_of(str(site.certificates), "actor")) == ""


def test_a_certificate_of_no_role_gets_in_and_may_nothing(site: Locked, tmp_path: Path) -> None:
    config = site.client("actor", **site.issue("coffee-machine", tmp_path))
    got: list[str] = []
    with session(config) as stranger, session(site.client("router")) as witness:
        witness.declare_subscriber("riposte/v1/**", lambda it: got.append(str(it.key_expr)))
        heard: list[str] = []
        for pattern in ("**", "riposte/v1/**", "@/**"):
            stranger.declare_subscriber(pattern, lambda it: heard.append(str(it.key_expr)))
        deadline = time.monotonic() + 20
        while "riposte/v1/probe/marker" not in got and time.monotonic() < deadline:
            stranger.put(BATS_KEY, "lies", allowed_destination=zenoh.Locality.REMOTE)
            with session(site.client("router")) as other:
                other.put("riposte/v1/probe/marker", "x")
            time.sleep(0.1)
        assert set(got) == {"riposte/v1/probe/marker"}
        assert heard == []
    site.await_event("stranger_connected", role="coffee-machine")
    site.await_event("messages_refused", role="coffee-machine")


@pytest.mark.parametrize("shared_memory", [False, True])
def test_a_message_over_the_limit_of_its_topic_passes_no_router(
    site: Locked, shared_memory: bool
) -> None:
    def client(role: str) -> str:
        config = json.loads(site.client(role))
        config["transport"]["shared_memory"]["enabled"] = shared_memory
        return json.dumps(config)

    got: list[int] = []
    with session(client("page")) as reader, session(client("robot_io")) as writer:
        reader.declare_subscriber(BATS_KEY, lambda it: got.append(len(it.payload)))
        deadline = time.monotonic() + 20
        while BATS.max_bytes not in got and time.monotonic() < deadline:
            for size in (1 << 20, BATS.max_bytes + 65, BATS.max_bytes):
                writer.put(BATS_KEY, bytes(size), congestion_control=zenoh.CongestionControl.BLOCK)
            time.sleep(0.1)
        time.sleep(0.3)
    assert set(got) == {BATS.max_bytes}
    site.await_event("messages_refused", role="robot_io")


def test_a_message_that_is_longer_than_any_may_be_is_refused_by_name(site: Locked) -> None:
    huge = bytes(2 * MAX_MESSAGE)
    got: list[int] = []
    with session(site.client("page")) as reader, session(site.client("robot_io")) as writer:
        reader.declare_subscriber(BATS_KEY, lambda it: got.append(len(it.payload)))
        deadline = time.monotonic() + 20
        while 10 not in got and time.monotonic() < deadline:
            for payload in (huge, bytes(10)):
                writer.put(BATS_KEY, payload, congestion_control=zenoh.CongestionControl.BLOCK)
            time.sleep(0.1)
    assert set(got) == {10}
    site.await_event("messages_refused", role="robot_io")


def test_nobody_reads_the_administration_of_a_router(site: Locked) -> None:
    for role in ("operator", "actor", "router"):
        with session(site.client(role)) as asker:
            own = str(asker.info.zid())
            replies = [str(it.ok.key_expr) for it in asker.get("@/**", timeout=2.0) if it.ok]
            assert [key for key in replies if own not in key] == []


def test_a_service_that_is_refused_ends_with_one_line_and_no_secret(
    site: Locked, tmp_path: Path
) -> None:
    keep(tmp_path / "other", [], [], NOW, 10)
    shutil.copy(site.certificates / "ca.crt", tmp_path / "other" / "ca.crt")
    done = subprocess.run(
        [
            sys.executable, "-m", "services.referee", "--run", str(tmp_path / "run"),
            "--connect", site.endpoint, "--certificates", str(tmp_path / "other"),
            "--set", "bus.open_seconds=0.5",
        ],
        cwd=ROOT, capture_output=True, text=True, timeout=90,
    )  # fmt: skip
    assert done.returncode == EXIT_BUS_LOST
    (line,) = (line for line in done.stderr.splitlines() if line.startswith("referee-0: no router"))
    assert "refused referee.crt" in line
    assert_no_secret([tmp_path / "other"], tmp_path / "run", done.stdout + done.stderr)


@pytest.mark.slow
def test_no_key_is_in_what_a_locked_site_writes(
    site: Locked, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = (tmp_path / "said.txt").open("wb")
    services = [
        subprocess.Popen(
            [
                sys.executable,
                "-m",
                f"services.{role}",
                "--run",
                str(tmp_path / "run"),
                "--run-id",
                "kept",
                "--connect",
                site.endpoint,
                "--certificates",
                str(site.certificates),
                *more,
            ],
            cwd=ROOT,
            stdout=output,
            stderr=output,
        )
        for role, more in (("referee", ()), ("recorder", ("--set", "recorder.live=false")))
    ]
    output.close()
    try:
        deadline = time.monotonic() + 60
        heard = ""
        while "referee-0" not in heard and time.monotonic() < deadline:
            with contextlib.suppress(BusError):
                status([
                    "--connect", site.endpoint, "--run-id", "kept", "--json",
                    "--certificates", str(site.certificates),
                ])  # fmt: skip
            heard += capsys.readouterr().out
        assert "referee-0" in heard
    finally:
        for process in services:
            process.terminate()
        for process in services:
            process.wait(30)
    text = heard + (tmp_path / "said.txt").read_text()
    assert_no_secret([site.certificates], tmp_path / "run", text)
    assert_no_secret([site.certificates], site.log.parent, site.output.read_text())
