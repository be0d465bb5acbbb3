"""TLS for a panel that other computers can reach: a certificate of its own, and what one says.

A shop with a CA gives its own certificate. Else ``robolink panel cert`` makes one that signs
itself; a person compares its fingerprint once on each tablet.
"""

import os
import ssl
import stat
from collections.abc import Collection
from dataclasses import dataclass
from datetime import datetime
from ipaddress import ip_address
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID

from robolink.errors import ConfigError
from robolink.files.certificates import (
    SIGNING,
    CertificatePurpose,
    certificate_as_pem,
    fingerprint_of,
    key_as_pem,
    self_signed,
)
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
    called = tuple(dict.fromkeys(names))
    purpose = CertificatePurpose(
        f"robolink panel {called[0]}",
        [_general_name(name) for name in called],
        SIGNING,
        [ExtendedKeyUsageOID.SERVER_AUTH],
        VALID_DAYS - 1,
    )
    certificate = self_signed(key, purpose)
    try:
        make_folder(path.parent)
        write_whole(key_path, key_as_pem(key))  # for its owner only
        write_whole(path, certificate_as_pem(certificate))
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
    return Certificate(path, key, names, fingerprint_of(found), found.not_valid_after_utc)


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
