"""The folder that ``riposte certs`` keeps: made once, completed and renewed, never overwritten."""

import dataclasses
import datetime
import os
from collections.abc import Sequence
from pathlib import Path

from cryptography import x509

from services.jobs.certs.making import (
    Pair,
    certificate_pem,
    hosts_of,
    is_signed_by,
    issue,
    key_pem,
    new_authority,
    read_key,
)
from shared.errors import ConfigError
from shared.messages.topics import CERTIFIED
from shared.runtime.files import atomic_write

LOOPBACK_NAMES = ("localhost", "127.0.0.1", "::1")
"""Hosts of every router's certificate: the machine it runs on has processes, too."""
PRIVATE = "private"
"""Folder of the authority's key, which leaves this machine for nobody."""


@dataclasses.dataclass(frozen=True)
class Kept:
    """A certificate of the folder."""

    role: str
    """``ca`` for the authority."""
    expires: datetime.datetime
    hosts: tuple[str, ...]
    is_new: bool


def keep(
    folder: Path,
    hosts: Sequence[str],
    renew: Sequence[str],
    now: datetime.datetime,
    days: int,
) -> list[Kept]:
    """Make what is missing in a folder and what is to be renewed; return all that is in it.

    Args:
        folder: of the site; may be missing.
        hosts: where routers are reached; none: those of the certificate that is there.
        renew: roles that get a new key and certificate.
        now: with a time zone.
        days: for how long new ones are valid.

    Raises:
        ConfigError: the folder holds other things or is damaged; the hosts are others than
            those of the router's certificate; something cannot be written.
    """
    authority, is_new = _authority(folder, now)
    kept = [Kept("ca", authority.certificate.not_valid_after_utc, (), is_new)]
    for role in CERTIFIED:
        old = None if role in renew else _certificate(folder, role, authority)
        wanted = _hosts(folder, hosts) if role == "router" else ()
        if old is not None and wanted:
            _check_hosts(folder, hosts_of(old), wanted, is_asked=bool(hosts))
        certificate = old or _issued(folder, authority, role, wanted, now, days)
        kept.append(
            Kept(
                role,
                certificate.not_valid_after_utc,
                hosts_of(certificate) if role == "router" else (),
                old is None,
            )
        )
    return kept


def _issued(
    folder: Path,
    authority: Pair,
    role: str,
    hosts: tuple[str, ...],
    now: datetime.datetime,
    days: int,
) -> x509.Certificate:
    """Write a new key and certificate; return the certificate."""
    pair = issue(authority, role, hosts, now, days)
    _write(folder / f"{role}.key", key_pem(pair.key), is_secret=True)
    _write(folder / f"{role}.crt", certificate_pem(pair.certificate))
    return pair.certificate


def _authority(folder: Path, now: datetime.datetime) -> tuple[Pair, bool]:
    certificate, key = folder / "ca.crt", folder / PRIVATE / "ca.key"
    try:
        if certificate.exists() and key.exists():
            return _read_authority(certificate, key), False
        if folder.exists() and (found := sorted(path.name for path in folder.iterdir())):
            raise ConfigError(
                f"{folder} holds {found[0]!r} and not both ca.crt and {PRIVATE}/ca.key, so it was "
                "not made here: name another folder, or the one the authority was made in"
            )
        folder.mkdir(parents=True, exist_ok=True)
        key.parent.mkdir(mode=0o700)
    except OSError as error:
        raise _cannot(folder, error) from error
    pair = new_authority(f"Riposte site {folder.resolve().name}"[:64], now)
    _write(key, key_pem(pair.key), is_secret=True)
    _write(certificate, certificate_pem(pair.certificate))
    return pair, True


def _read_authority(certificate: Path, key: Path) -> Pair:
    try:
        pair = Pair(
            read_key(key.read_bytes()), x509.load_pem_x509_certificate(certificate.read_bytes())
        )
    except ValueError as error:  # its text may hold a part of the key
        raise ConfigError(f"{certificate} or {key} is damaged; use a copy of them") from error
    if pair.key.public_key() != pair.certificate.public_key():
        raise ConfigError(f"{key} is not the key of {certificate}; use the folder they came from")
    return pair


def _certificate(folder: Path, role: str, authority: Pair) -> x509.Certificate | None:
    """Return the certificate of a role that is in the folder, with its key."""
    path, key = folder / f"{role}.crt", folder / f"{role}.key"
    try:
        if not (path.exists() and key.exists()):
            return None
        certificate = x509.load_pem_x509_certificate(path.read_bytes())
        is_its_key = read_key(key.read_bytes()).public_key() == certificate.public_key()
    except OSError as error:
        raise _cannot(folder, error) from error
    except ValueError as error:
        raise ConfigError(f"{path} or {key} is damaged; add --renew {role}") from error
    if not is_its_key or not is_signed_by(certificate, authority.certificate):
        raise ConfigError(
            f"{path} is not of the authority in {folder}/ca.crt or not of {key.name}; "
            f"add --renew {role}"
        )
    return certificate


def _hosts(folder: Path, hosts: Sequence[str]) -> tuple[str, ...]:
    """Return the hosts of the router's certificate: those asked for, else those it had."""
    path = folder / "router.crt"
    if not hosts and path.exists():
        try:
            return hosts_of(x509.load_pem_x509_certificate(path.read_bytes()))
        except ValueError as error:
            raise ConfigError(f"{path} is damaged; name its hosts anew with --host") from error
    return tuple(dict.fromkeys((*hosts, *LOOPBACK_NAMES)))


def _check_hosts(
    folder: Path, have: tuple[str, ...], wanted: tuple[str, ...], *, is_asked: bool
) -> None:
    if is_asked and (lacking := [host for host in wanted if host not in have]):
        raise ConfigError(
            f"{folder}/router.crt is for {', '.join(have)}, not for {', '.join(lacking)}; "
            "add --renew router to make it anew, then restart the routers"
        )


def _write(path: Path, data: bytes, *, is_secret: bool = False) -> None:
    """Write a whole file; nobody else can ever read a secret one.

    Raises:
        ConfigError: it cannot be written.
    """
    before = os.umask(0o177 if is_secret else 0o133)
    try:
        atomic_write(path, data)
    finally:
        os.umask(before)


def _cannot(folder: Path, error: OSError) -> ConfigError:
    return ConfigError(f"cannot use {folder}: {error.strerror or error}; name another folder")
