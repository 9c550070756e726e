"""The configuration of Zenoh's own router: read by Zenoh, and as locked as ours."""

import json

import pytest
import zenoh

from shared.bus.refusals import LOG_FILTER
from tests.unit.deploy.found import DEPLOY, pods

CONFIG = DEPLOY / "zenoh/zenohd.json5"


@pytest.fixture
def config() -> zenoh.Config:
    return zenoh.Config.from_json5(CONFIG.read_text())


def test_strangers_plain_text_and_administration_are_shut_out(config: zenoh.Config):
    def said(path: str) -> object:
        return json.loads(config.get_json(path))

    assert said("mode") == "router"
    assert said("scouting/multicast/enabled") is False
    assert said("adminspace/enabled") is False
    assert said("transport/link/protocols") == ["tls"]
    assert said("transport/link/tls/enable_mtls") is True
    access = said("access_control")
    assert isinstance(access, dict)
    assert access["enabled"] is True
    assert access["default_permission"] == "deny"


def test_it_finds_its_certificate_and_its_port_where_the_pod_has_them(config: zenoh.Config):
    (router,) = (spec["containers"][0] for name, _, spec in pods() if name == "riposte-router")
    mounts = {mount["name"]: mount["mountPath"] for mount in router["volumeMounts"]}
    tls = json.loads(config.get_json("transport/link/tls"))
    assert tls["root_ca_certificate"] == f"{mounts['certificates']}/ca.crt"
    assert tls["listen_certificate"] == f"{mounts['certificates']}/router.crt"
    assert tls["listen_private_key"] == f"{mounts['certificates']}/router.key"
    (port,) = (port["containerPort"] for port in router["ports"])
    assert json.loads(config.get_json("listen/endpoints")) == [f"tls/0.0.0.0:{port}"]
    assert router["args"][:2] == ["--config", f"{mounts['config']}/{CONFIG.name}"]


def test_what_zenohd_switches_on_by_itself_is_switched_off_again(config: zenoh.Config):
    """Its ``main.rs`` enables both after it has read its file, and takes ``--cfg`` last."""
    (router,) = (spec["containers"][0] for name, _, spec in pods() if name == "riposte-router")
    _, _, *last = router["args"]
    assert last == ["--cfg=adminspace/enabled:false", "--cfg=plugins_loading/enabled:false"]
    for word in last:
        key, _, value = word.removeprefix("--cfg=").partition(":")
        config.insert_json5(key, "true")
        config.insert_json5(key, value)
        assert json.loads(config.get_json(key)) is False


def test_zenohd_logs_what_it_refuses_as_our_router_does():
    (router,) = (spec["containers"][0] for name, _, spec in pods() if name == "riposte-router")
    environment = {variable["name"]: variable["value"] for variable in router["env"]}
    assert environment["RUST_LOG"] == LOG_FILTER
