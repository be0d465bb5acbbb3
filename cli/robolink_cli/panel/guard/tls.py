"""TLS for a panel that other computers can reach: a certificate of its own, and what one says.

A shop with a CA gives its own certificate. Else ``robolink panel cert`` makes one that signs
itself: it is a leaf and no CA, so whoever steals its key can pretend to be this panel, and nobody
else. A person compares its fingerprint once on each tablet.
"""

import os
import ssl
import stat
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from robolink.errors import ConfigError
from robolink.files.durable import make_folder, state_folder, sync_folder, write_whole
from robolink.messages import tr
from robolink.timing import wall_time

VALID_DAYS: Final = 825
"""Longest that tablets of Apple accept (https://support.apple.com/en-us/103769)."""

_LONGEST_NAME: Final = 253
_MOST_NAME: Final = 64


@dataclass(frozen=True, slots=True)
class Certificate:
    """A certificate with its key, as files.

    Attributes:
        path, key: The files, PEM.
        names: The names and addresses that it is for.
        fingerprint: SHA-256, as browsers show it.
        ends: Until when it counts.
    """

    path: Path
    key: Path
    names: tuple[str, ...]
    fingerprint: str
    ends: datetime


def own_files() -> tuple[Path, Path]:
    """Return where the certificate and the key are that ``robolink panel cert`` makes."""
    folder = state_folder("panel")
    return folder / "certificate.pem", folder / "key.pem"


def make(names: Collection[str], *, replace: bool = False) -> Certificate:
    """Make a certificate that signs itself.

    Args:
        names: Names and addresses of this computer, as tablets call it.
        replace: Whether one that is there already may go.

    Raises:
        ConfigError: There is one already, a name is none, or it cannot be stored.
    """
    path, key_path = own_files()
    if not replace and (path.exists() or key_path.exists()):
        raise ConfigError(
            tr("There is a certificate already: {path}.", path=path),
            remedy=tr("Nothing was changed. To make a new one: robolink panel cert --replace"),
        )
    key = ec.generate_private_key(ec.SECP256R1())
    data = _signed(key, tuple(dict.fromkeys(names))).public_bytes(serialization.Encoding.PEM)
    secret = key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )
    try:
        make_folder(path.parent)
        write_whole(key_path, secret)  # for its owner only
        write_whole(path, data)
        sync_folder(path.parent)
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be written: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("No certificate was made."),
        ) from error
    return load(path, key_path)


def load(path: Path, key: Path) -> Certificate:
    """Return what a certificate says, once it is fit to be used.

    Args:
        path: The certificate, with its chain behind it, PEM.
        key: Its key, PEM, which only its owner may read.

    Raises:
        ConfigError: A file cannot be read or used: it is no PEM, the key is another's, others may
            read it, the time of the certificate is over or has not begun, or it names nobody.
    """
    if os.name == "posix" and key.exists() and stat.S_IMODE(key.stat().st_mode) & 0o077:
        raise ConfigError(
            tr("Others than its owner can read {path}.", path=key),
            remedy=tr("Run: chmod 600 {path}", path=key),
        )
    try:
        found = x509.load_pem_x509_certificate(path.read_bytes())
        context(path, key)
    except (OSError, ValueError) as error:
        cause = (error.strerror or error) if isinstance(error, OSError) else tr("it is no PEM")
        raise ConfigError(
            tr("{path} and its key make no TLS: {cause}.", path=path, cause=cause),
            remedy=tr("Give a certificate and its own key as PEM, or run: robolink panel cert"),
        ) from error
    if not found.not_valid_before_utc <= wall_time() <= found.not_valid_after_utc:
        raise ConfigError(
            tr(
                "The certificate {path} counts from {begin} to {end}.",
                path=path,
                begin=found.not_valid_before_utc.date(),
                end=found.not_valid_after_utc.date(),
            ),
            remedy=tr(
                "Check this computer's clock. To make a new one: robolink panel cert --replace"
            ),
        )
    names = _names(found)
    if not names:
        raise ConfigError(
            tr("The certificate {path} is for no name.", path=path),
            remedy=tr("Browsers need its names as subject alternative names."),
        )
    fingerprint = found.fingerprint(hashes.SHA256()).hex(":").upper()
    return Certificate(path, key, names, fingerprint, found.not_valid_after_utc)


def context(path: Path, key: Path) -> ssl.SSLContext:
    """Return what a server needs of it: TLS 1.2 or later.

    Raises:
        OSError: The files cannot be read, or do not belong together.
    """
    made = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    made.minimum_version = ssl.TLSVersion.TLSv1_2
    made.options |= ssl.OP_NO_RENEGOTIATION | ssl.OP_NO_COMPRESSION
    made.load_cert_chain(path, key, password=_no_password)
    return made


def _no_password() -> str:
    raise OSError(tr("its key has a password, for which nobody can be asked"))


def _signed(key: ec.EllipticCurvePrivateKey, names: Sequence[str]) -> x509.Certificate:
    now = datetime.now(UTC)
    called = [_general_name(name) for name in names]
    called_so = f"robolink panel {names[0]}"[:_MOST_NAME]
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, called_so)])
    usage = x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=False,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - timedelta(hours=1))
        .not_valid_after(now + timedelta(days=VALID_DAYS - 1))
        .add_extension(x509.SubjectAlternativeName(called), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(usage, critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .sign(key, hashes.SHA256())
    )


def _general_name(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        pass
    labels = name.split(".")
    fits = all(
        0 < len(label) < _MOST_NAME
        and label.isascii()
        and label.replace("-", "").isalnum()
        and label.strip("-") == label
        for label in labels
    )
    if not fits or len(name) > _LONGEST_NAME:
        raise ConfigError(
            tr("{name!r} is neither the name nor the address of a computer.", name=name),
            remedy=tr("No certificate was made."),
        )
    return x509.DNSName(name.lower())


def _names(found: x509.Certificate) -> tuple[str, ...]:
    try:
        said = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except (x509.ExtensionNotFound, ValueError):
        return ()
    names = said.get_values_for_type(x509.DNSName)
    return (*names, *map(str, said.get_values_for_type(x509.IPAddress)))
