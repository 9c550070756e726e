"""The configuration for Zenoh's own router."""

import json
from pathlib import Path

import pytest

from services.router.__main__ import main
from shared.bus.config import BusConfig, router_json
from shared.errors import ConfigError

ROOT = Path(__file__).resolve().parents[3]


def test_the_shipped_configuration_is_what_the_code_makes(capsys) -> None:
    folder = ROOT / "deploy" / "zenoh"
    assert main([str(folder / "site.toml"), "--print-config"]) == 0
    printed = capsys.readouterr().out
    assert printed == (folder / "zenohd.json5").read_text(), "run make docs"
    config = json.loads(printed)
    assert config["listen"]["endpoints"] == ["tls/0.0.0.0:7447"]
    assert config["access_control"]["default_permission"] == "deny"


def test_flags_of_the_router_go_into_what_is_printed(capsys) -> None:
    flags = ["--listen", "tls/10.0.0.1:1", "--certificates", "/certs", "--print-config"]
    assert main(flags) == 0
    cfg = BusConfig(listen=("tls/10.0.0.1:1",), certificates="/certs")
    assert capsys.readouterr().out == router_json(cfg) + "\n"


def test_what_would_not_be_safe_is_not_printed() -> None:
    with pytest.raises(ConfigError, match="riposte certs"):
        main(["--listen", "tcp/0.0.0.0:7447", "--print-config"])
