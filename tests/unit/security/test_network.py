"""What a site file may ask of the network."""

import json
from pathlib import Path

import pytest
from structlog.testing import capture_logs

from shared.bus.config import BusConfig, client_json, router_json, warn_of_plain_network
from shared.bus.tls import check_files
from shared.errors import ConfigError

ELSEWHERE = ("tcp/192.168.1.5:7447", "tls/robot.example.org:7447", "tcp/0.0.0.0:7447", "tcp/[::]:1")
HERE = ("tcp/127.0.0.1:7447", "tcp/localhost:7447", "tcp/[::1]:7447", "tcp/127.8.9.1:1")


@pytest.mark.parametrize("field", ["connect", "listen"])
@pytest.mark.parametrize("endpoint", ELSEWHERE)
def test_an_endpoint_off_this_machine_needs_certificates_and_the_error_says_how(
    field: str, endpoint: str
) -> None:
    with pytest.raises(ValueError, match=r"riposte certs DIR --host") as caught:
        BusConfig(**{field: (endpoint,)})
    assert endpoint in str(caught.value)


@pytest.mark.parametrize("endpoint", HERE)
def test_the_loopback_needs_none(endpoint: str) -> None:
    assert BusConfig(listen=(endpoint,)).exposed == ()


def test_a_plain_network_must_be_asked_for_and_is_warned_of() -> None:
    cfg = BusConfig(listen=("tcp/0.0.0.0:7447",), plain_network=True)
    with capture_logs() as logs:
        warn_of_plain_network(cfg)
        warn_of_plain_network(BusConfig(plain_network=True))
    assert [(log["event"], log["log_level"]) for log in logs] == [
        ("network_unprotected", "warning")
    ]
    assert "0.0.0.0" in logs[0]["endpoints"]


def test_a_plain_network_and_certificates_contradict_each_other() -> None:
    with pytest.raises(ValueError, match="plain_network"):
        BusConfig(certificates="certs", plain_network=True)


def test_with_certificates_an_endpoint_elsewhere_must_be_encrypted() -> None:
    with pytest.raises(ValueError, match="say tls/robot:7447"):
        BusConfig(connect=("tcp/robot:7447",), certificates="certs")
    BusConfig(connect=("tls/robot:7447", "quic/robot:7447"), certificates="certs")


def test_with_certificates_plain_links_within_the_machine_are_refused_too() -> None:
    cfg = BusConfig(certificates="certs")
    for make in (lambda: client_json(cfg, "actor"), lambda: router_json(cfg)):
        with pytest.raises(ConfigError, match=r"say tls/127\.0\.0\.1:7447"):
            make()


def test_certificates_that_are_not_there_are_named(tmp_path: Path) -> None:
    (tmp_path / "ca.crt").write_text("")
    with pytest.raises(ConfigError, match=r"actor\.crt: No such file.*riposte certs"):
        check_files(str(tmp_path), "actor")


def test_a_key_that_everybody_may_read_is_warned_of(tmp_path: Path) -> None:
    for name in ("ca.crt", "actor.crt", "actor.key"):
        (tmp_path / name).write_text("secret")
    for mode, events in ((0o600, []), (0o640, []), (0o644, ["private_key_exposed"])):
        (tmp_path / "actor.key").chmod(mode)
        with capture_logs() as logs:
            check_files(str(tmp_path), "actor")
        assert [log["event"] for log in logs] == events
        assert "secret" not in str(logs)


def test_nobody_scouts_listens_or_speaks_another_protocol() -> None:
    cfg = BusConfig(listen=("tcp/127.0.0.1:7447",))
    client, router = json.loads(client_json(cfg, "actor")), json.loads(router_json(cfg))
    for config in (client, router):
        assert config["scouting"] == {"multicast": {"enabled": False}, "gossip": {"enabled": False}}
        assert config["adminspace"] == {"enabled": False}
        assert config["transport"]["link"]["protocols"] == ["tcp"]
    assert client["listen"] == {"endpoints": []}
    assert router["listen"]["endpoints"] == ["tcp/127.0.0.1:7447"]


def test_an_endpoint_without_a_known_protocol_or_with_options_is_refused() -> None:
    for endpoint in ("ws/127.0.0.1:1", "udp/127.0.0.1:1", "tcp/127.0.0.1:1#iface=eth0", "tcp/a:b"):
        with pytest.raises(ValueError, match="expected an endpoint"):
            BusConfig(connect=(endpoint,))
