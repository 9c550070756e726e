"""`riposte certs`."""

import datetime
import json
import stat
from pathlib import Path

import pytest
from cryptography import x509

from services.jobs.certs.command import main
from services.jobs.certs.folder import keep
from shared.errors import ConfigError
from shared.messages.topics import CERTIFIED

NOW = datetime.datetime(2026, 5, 1, tzinfo=datetime.UTC)


def certificate(folder: Path, role: str) -> x509.Certificate:
    return x509.load_pem_x509_certificate((folder / f"{role}.crt").read_bytes())


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_everybody_gets_a_key_that_only_its_owner_reads_and_a_certificate_of_one_authority(
    tmp_path: Path, monkeypatch, capsys
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["site", "--host", "10.0.0.5", "--host", "Router.example.org", "--json"]) == 0
    folder = tmp_path / "site"
    said = json.loads(capsys.readouterr().out)
    assert [one["role"] for one in said["certificates"]] == ["ca", *CERTIFIED]
    for role in CERTIFIED:
        found = certificate(folder, role)
        found.verify_directly_issued_by(certificate(folder, "ca"))
        (name,) = found.subject
        assert name.value == role
    for path in (*folder.glob("*.key"), folder / "private" / "ca.key"):
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert stat.S_IMODE((folder / "private").stat().st_mode) == 0o700
    assert not (folder / "ca.key").exists()
    # a second call keeps all of it
    before = contents(folder)
    assert main(["site", "--host", "router.example.org"]) == 0
    assert contents(folder) == before
    out = capsys.readouterr().out
    assert "router.example.org" in out
    assert "(365 days)" in out
    # renewing makes one anew, for the same hosts
    assert main(["site", "--renew", "router"]) == 0
    changed = {name for name, data in contents(folder).items() if data != before[name]}
    assert changed == {"router.crt", "router.key"}
    names = certificate(folder, "router").extensions.get_extension_for_class(
        x509.SubjectAlternativeName
    )
    assert {str(name.value) for name in names.value} == {
        "10.0.0.5", "router.example.org", "localhost", "127.0.0.1", "::1",
    }  # fmt: skip
    # other hosts than it has are not added behind anybody's back
    with pytest.raises(ConfigError, match=r"not for elsewhere; add --renew router"):
        main(["site", "--host", "elsewhere"])


def test_only_the_router_may_be_a_server(tmp_path: Path) -> None:
    keep(tmp_path / "site", [], [], NOW, 10)
    for role in CERTIFIED:
        uses = certificate(tmp_path / "site", role).extensions.get_extension_for_class(
            x509.ExtendedKeyUsage
        )
        assert (x509.ExtendedKeyUsageOID.SERVER_AUTH in uses.value) == (role == "router")


@pytest.mark.parametrize(
    "host", ["tcp/robot", "robot:7447", "", "ro bot", "robot-", "1.2.3", "a" * 64, "röbot"]
)
def test_what_is_no_host_is_refused(host: str, tmp_path: Path, capsys) -> None:
    with pytest.raises(SystemExit) as caught:
        main([str(tmp_path / "site"), "--host", host])
    assert caught.value.code == 2
    assert "is no host" in capsys.readouterr().err
    assert not (tmp_path / "site").exists()


def test_a_folder_with_other_things_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("mine")
    with pytest.raises(ConfigError, match=r"thesis\.tex.*not made here"):
        keep(tmp_path, [], [], NOW, 10)
    assert list(contents(tmp_path)) == ["thesis.tex"]


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match=r"cannot use .*file/site"):
        keep(tmp_path / "file" / "site", [], [], NOW, 10)


def test_a_copy_without_the_authoritys_key_makes_nothing(tmp_path: Path) -> None:
    keep(tmp_path / "site", [], [], NOW, 10)
    (tmp_path / "site" / "private" / "ca.key").unlink()
    with pytest.raises(ConfigError, match="the one the authority was made in"):
        keep(tmp_path / "site", [], ["actor"], NOW, 10)


def test_what_is_not_of_this_authority_is_pointed_out_and_can_be_renewed(tmp_path: Path) -> None:
    for name in ("ours", "theirs"):
        keep(tmp_path / name, [], [], NOW, 10)
    for name in ("actor.crt", "actor.key"):
        (tmp_path / "ours" / name).write_bytes((tmp_path / "theirs" / name).read_bytes())
    with pytest.raises(ConfigError, match="--renew actor"):
        keep(tmp_path / "ours", [], [], NOW, 10)
    kept = keep(tmp_path / "ours", [], ["actor"], NOW, 10)
    assert [one.role for one in kept if one.is_new] == ["actor"]
    (tmp_path / "ours" / "learner.key").write_bytes(b"nonsense")
    with pytest.raises(ConfigError, match="--renew learner") as caught:
        keep(tmp_path / "ours", [], [], NOW, 10)
    assert "nonsense" not in str(caught.value)


def test_no_certificate_outlives_its_authority(tmp_path: Path) -> None:
    kept = {one.role: one for one in keep(tmp_path / "site", [], [], NOW, 3650)}
    later = NOW + datetime.timedelta(days=3000)
    renewed = {one.role: one for one in keep(tmp_path / "site", [], ["page"], later, 3650)}
    assert renewed["page"].expires == kept["ca"].expires
