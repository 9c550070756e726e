"""Every command line in deploy/ is one that our own parsers take."""

import contextlib
import io
import re
from pathlib import Path

import pytest

from services import cli
from services.jobs.site import section_types
from shared.config.site import load_site
from shared.errors import ConfigError
from shared.runtime.serve import parse_args, role_of
from tests.unit.deploy.found import (
    DEPLOY,
    OWN_IMAGES,
    Found,
    command_lines,
    compose,
    filled,
    pods,
    scripts,
)

FOUND = command_lines()
SERVICES = {command.name for command in cli.SERVICES}


def said(argv: list[str]) -> str:
    """What a command says of itself."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), pytest.raises(SystemExit) as end:
        cli.main(argv)
    assert end.value.code == 0
    return out.getvalue()


def check(command: Found) -> None:
    role, *words = command.words
    assert role in cli.COMMANDS, f"{command.where}: there is no `riposte {role}`"
    if role not in SERVICES:
        about = said([role, "--help"])
        for word in words:
            flag = word.partition("=")[0]
            known = re.search(rf"(?<![\w-]){re.escape(flag)}(?![\w-])", about)
            assert not flag.startswith("-") or known, f"{command.where}: {role} has no {flag}"
        return
    if role == "router" and "--listen" in words:
        at = words.index("--listen")
        del words[at : at + 2]
    err = io.StringIO()
    try:
        with contextlib.redirect_stderr(err):
            args = parse_args(role, words)
    except SystemExit:
        pytest.fail(f"{command.where}: {err.getvalue()}")
    load_site(None, section_types(), args.overrides)
    assert (args.agent is not None) == (role in ("learner", "policy")), command.where


@pytest.mark.parametrize("command", FOUND, ids=[found.where for found in FOUND])
def test_a_command_line_is_one_that_we_take(command: Found):
    check(command)


def test_commands_were_found_in_every_kind_of_file():
    places = {found.where.split(" ")[0].rpartition(".")[2] for found in FOUND}
    assert places >= {"kubernetes", "compose", "service", "sbatch", "md"}


@pytest.mark.parametrize(
    "words",
    [
        ("actr",),
        ("actor", "--conect", "tls/a:1"),
        ("learner", "--agent", "nobody"),
        ("learner",),
        ("metrics", "--set", "metrics.prt=1"),
        ("certs", "DIR", "--hots", "a"),
    ],
)
def test_a_wrong_command_line_does_not_pass(words: tuple[str, ...]):
    with pytest.raises((AssertionError, ConfigError, pytest.fail.Exception)):
        check(Found("a test", words))


def site_files() -> list[Path]:
    return sorted(DEPLOY.rglob("site.toml"))


@pytest.mark.parametrize("path", site_files(), ids=str)
def test_a_site_file_has_only_sections_and_keys_that_there_are(path: Path):
    assert len(load_site(path, section_types())) == len(section_types())


def test_each_process_gets_its_own_certificate_and_no_other():
    for name, _, spec in pods():
        secrets = [
            volume["secret"]["secretName"] for volume in spec["volumes"] if "secret" in volume
        ]
        (container,) = spec["containers"]
        role = container["args"][0] if container["image"] in OWN_IMAGES else "router"
        assert secrets == [f"riposte-certificates-{certificate(role)}"], name
    for name, service in compose()["services"].items():
        if service["image"] not in OWN_IMAGES:
            continue
        mounted = {
            Path(volume.split(":")[0]).name
            for volume in map(filled, service["volumes"])
            if volume.startswith("./certificates/")
        }
        role = certificate(service["command"][0])
        assert mounted == {"ca.crt", f"{role}.crt", f"{role}.key"}, name


def certificate(role: str) -> str:
    return "router" if role == "router" else role_of(role)


def test_only_learners_get_the_image_with_torch():
    images = {service["command"][0]: service["image"] for service in compose()["services"].values()
              if service["image"] in OWN_IMAGES}  # fmt: skip
    for _, _, spec in pods():
        (container,) = spec["containers"]
        if container["image"] in OWN_IMAGES:
            images[container["args"][0]] = container["image"]
    assert {role for role, image in images.items() if image == "riposte-train"} == {"learner"}
    assert {"actor", "league", "metrics"} <= images.keys()


def test_there_are_scripts_to_look_at():
    assert {path.name for path in scripts()} >= {"actors.sbatch", "secrets.sh", "riposte-alive"}
