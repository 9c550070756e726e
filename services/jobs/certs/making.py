"""Keys and certificates of a site: an authority, and what it says of its processes.

Only the router's certificate may stand for a server, and only for the hosts it names, so that no
other role can play the router to somebody. Keys are of the curve P-256.
"""

import dataclasses
import datetime
import ipaddress

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

AUTHORITY_DAYS = 3650
EARLIER = datetime.timedelta(hours=1)
"""Certificates are valid from this long ago, for machines whose clocks are behind."""

Key = ec.EllipticCurvePrivateKey


@dataclasses.dataclass(frozen=True)
class Pair:
    """A key and the certificate of it."""

    key: Key
    certificate: x509.Certificate


def new_authority(name: str, now: datetime.datetime) -> Pair:
    """Return an authority that signs itself.

    Args:
        name: of the site, shown by tools.
        now: when it begins, with a time zone.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    subject = _name(name)
    certificate = (
        _builder(key, subject, subject, now, AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return Pair(key, certificate)


def issue(
    authority: Pair, role: str, hosts: tuple[str, ...], now: datetime.datetime, days: int
) -> Pair:
    """Return a key and a certificate whose common name is ``role``.

    Args:
        authority: signs it.
        role: what the access rules know its holder by.
        hosts: names and addresses it may be a server of; none: it is a client's.
        now: when it begins, with a time zone.
        days: for how long it is valid; no longer than the authority is.
    """
    key = ec.generate_private_key(ec.SECP256R1())
    issuer = authority.certificate
    uses = [ExtendedKeyUsageOID.CLIENT_AUTH]
    if hosts:
        uses.append(ExtendedKeyUsageOID.SERVER_AUTH)
    names = [_general_name(host) for host in hosts] or [x509.DNSName(role.replace("_", "-"))]
    builder = (
        _builder(key, _name(role), issuer.subject, now, days, issuer.not_valid_after_utc)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage(uses), critical=False)
        .add_extension(x509.SubjectAlternativeName(names), critical=False)
        .add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_public_key(issuer.public_key()),  # pyright: ignore[reportArgumentType]
            critical=False,
        )
    )
    return Pair(key, builder.sign(authority.key, hashes.SHA256()))


def is_signed_by(certificate: x509.Certificate, authority: x509.Certificate) -> bool:
    """Return whether an authority signed a certificate."""
    try:
        certificate.verify_directly_issued_by(authority)
    except (InvalidSignature, ValueError, TypeError):
        return False
    return True


def hosts_of(certificate: x509.Certificate) -> tuple[str, ...]:
    """Return the names and addresses a certificate is for."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return ()
    return tuple(str(name.value) for name in names)


def certificate_pem(certificate: x509.Certificate) -> bytes:
    """Return the text of a certificate."""
    return certificate.public_bytes(serialization.Encoding.PEM)


def key_pem(key: Key) -> bytes:
    """Return the text of a key, not encrypted: processes start without a person."""
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def read_key(pem: bytes) -> Key:
    """Return the key of a text.

    Raises:
        ValueError: it is not one of ours.
    """
    key = serialization.load_pem_private_key(pem, None)
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise ValueError("not a key on an elliptic curve")
    return key


def _builder(
    key: Key,
    subject: x509.Name,
    issuer: x509.Name,
    now: datetime.datetime,
    days: int,
    until: datetime.datetime | None = None,
) -> x509.CertificateBuilder:
    end = now + datetime.timedelta(days=days)
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - EARLIER)
        .not_valid_after(end if until is None else min(end, until))
    )


def _name(text: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, text)])


def _general_name(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(host))
    except ValueError:
        return x509.DNSName(host)


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=signs_certificates,
        crl_sign=signs_certificates,
        encipher_only=False,
        decipher_only=False,
    )
