"""Certificates of the bus: which files a process shows, and why a router would not have them."""

import dataclasses
import os
import socket
import ssl
from pathlib import Path
from typing import Any

import structlog

from shared.errors import ConfigError

HANDSHAKE_SECONDS = 2.0
VERDICT_SECONDS = 0.3
"""How long the other side may take to refuse what it was shown."""

log = structlog.get_logger()


@dataclasses.dataclass(frozen=True)
class TlsFiles:
    """What a process shows, and by what it knows the others."""

    authority: Path
    certificate: Path
    key: Path


def files_of(folder: str, role: str) -> TlsFiles:
    """Return where the files of a role are in a folder of ``riposte certs``."""
    base = Path(folder).expanduser().absolute()
    return TlsFiles(base / "ca.crt", base / f"{role}.crt", base / f"{role}.key")


def check_files(folder: str, role: str) -> None:
    """Refuse files of a role that cannot be read, and warn of a key that others can read.

    Raises:
        ConfigError: says which, and where they come from.
    """
    files = files_of(folder, role)
    for path in (files.authority, files.certificate, files.key):
        try:
            path.open("rb").close()
        except OSError as error:
            raise ConfigError(
                f"[bus] certificates: cannot read {path}: {error.strerror or error}; make it with "
                f"`riposte certs {folder}`, or copy ca.crt, {role}.crt and {role}.key from where "
                "they were made"
            ) from error
    if os.stat(files.key).st_mode & 0o007:
        log.warning("private_key_exposed", path=str(files.key), do=f"chmod 600 {files.key}")


def tls_json(files: TlsFiles) -> dict[str, Any]:
    """Return Zenoh's configuration of both ends: everyone shows a certificate, to everyone."""
    return {
        "root_ca_certificate": str(files.authority),
        "listen_certificate": str(files.certificate),
        "listen_private_key": str(files.key),
        "connect_certificate": str(files.certificate),
        "connect_private_key": str(files.key),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,  # of either certificate: nobody outstays theirs
    }


def why_refused(endpoint: str, files: TlsFiles) -> str:
    """Return why a session does not open on a TLS endpoint; empty where a handshake succeeds.

    The bus's library says no more than that its time was up, so this tries a handshake of its
    own, ``HANDSHAKE_SECONDS`` long at most.
    """
    host, _, port = endpoint.partition("/")[2].rpartition(":")
    host = host.strip("[]")
    ours = f"{files.certificate.name} in {files.certificate.parent}"
    try:
        context = ssl.create_default_context(cafile=str(files.authority))
        context.load_cert_chain(files.certificate, files.key)
    except (OSError, ssl.SSLError) as error:
        return f"cannot use {ours}: {_reason(error)}"
    is_open = False
    try:
        with (
            socket.create_connection((host, int(port)), HANDSHAKE_SECONDS) as plain,
            context.wrap_socket(plain, server_hostname=host) as link,
        ):
            is_open = True
            link.settimeout(VERDICT_SECONDS)  # a refusal comes after our half of the handshake
            return "" if link.recv(1) else "the router ended the connection at once"
    except ssl.SSLCertVerificationError as error:
        return (
            f"the router's certificate is not for {host}, or not of the authority of {ours} "
            f"({error.verify_message}): name all hosts of a router with `riposte certs --host`, "
            "and copy ca.crt from the folder its certificate was made in"
        )
    except ssl.SSLError as error:
        return (
            f"the router speaks no TLS or refused {ours} ({_reason(error)}): the certificate must "
            "be of the authority that made the router's, and valid today (`riposte certs` says "
            "until when)"
        )
    except TimeoutError:  # where the handshake was over, it waits for us to speak: we are in
        return "" if is_open else f"no answer within {HANDSHAKE_SECONDS:g} s"
    except OSError as error:
        return error.strerror or str(error)


def _reason(error: OSError) -> str:
    return getattr(error, "reason", None) or error.strerror or str(error)
