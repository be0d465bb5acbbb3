"""This computer's certificate as an OPC UA client: made once, kept like a password.

A server trusts it by hand, so a new one has to be trusted again: it is made when it is needed
first, and afterwards only at a person's command. Key and certificate stand in one file of mode
600, which is replaced whole: a key never stands beside the certificate of another. The certificate
alone stands beside it as DER, for whoever gives it to a server.

Source: OPC 10000-6 6.2.2 (application instance certificates).
"""

import platform
import re
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import Final

from robolink.errors import ConfigError
from robolink.files.durable import make_folder, state_folder, sync_folder, write_whole
from robolink.files.named import OthersMayReadError, holds, read_named
from robolink.messages import tr
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import wall_time

VALID_DAYS: Final = 1825
"""Five years: each new one has to be trusted at every PLC."""
WARNED_DAYS: Final = 60
"""For so many days before its end ``check`` and ``doctor`` say so."""

_MOST_BYTES: Final = 100_000
_KEY_BITS: Final = 2048  # what all three policies take


@dataclass(frozen=True, slots=True)
class OwnCertificate:
    """A certificate and its key.

    Attributes:
        der: The certificate.
        key: Its private key, PEM (PKCS 8).
        application_uri: The URI in it, by which a server knows this application.
        fingerprint: SHA-256, as servers show it.
        begins, ends: From when until when it counts.
        path: The file with both.
        public_path: The file with the certificate alone, DER.
    """

    der: bytes
    key: bytes = field(repr=False)
    application_uri: str
    fingerprint: str
    begins: datetime
    ends: datetime
    path: Path
    public_path: Path

    @property
    def days_left(self) -> int:
        """For how many whole days it counts from now on; negative once it has ended."""
        return (self.ends - wall_time()).days

    @property
    def ends_soon(self) -> bool:
        """Whether somebody should see to a new one."""
        return self.days_left < WARNED_DAYS

    def require_in_force(self) -> None:
        """Refuse one that does not count today: a server would, and less clearly.

        Raises:
            ConfigError: Its time is over or has not begun.
        """
        if not self.begins <= wall_time() <= self.ends:
            raise ConfigError(
                tr(
                    "This computer's certificate for OPC UA counts from {begin} to {end}.",
                    begin=self.begins.date(),
                    end=self.ends.date(),
                ),
                remedy=tr(
                    "Check this computer's clock. To make a new one: {command}. Then trust it at "
                    "each PLC.",
                    command=remedy_word(RemedyWord.RENEW_CERTIFICATE),
                ),
            )


def own_files() -> tuple[Path, Path]:
    """Return where key and certificate are, and the certificate alone."""
    folder = state_folder("opcua")
    return folder / "client.pem", folder / "client.der"


def find_own_certificate(*, stopping: bool = False) -> OwnCertificate | None:
    """Return this computer's certificate; ``None`` where none was made yet.

    The file for the PLC is made to hold the same one, whatever became of it meanwhile.

    Args:
        stopping: Whether this is for a stop: it uses a key that others may read, too.

    Raises:
        ConfigError: It cannot be read, is damaged, or others may read it.
    """
    path, public_path = own_files()
    try:
        text = read_named(path, most_bytes=_MOST_BYTES, secret=not stopping)
    except FileNotFoundError:
        return None
    except OthersMayReadError as error:
        raise ConfigError(
            tr("Others than its owner can read {path}.", path=path),
            remedy=tr("Run: chmod 600 {path}", path=path),
        ) from error
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be read: {cause}.", path=path, cause=error.strerror or error),
            remedy=_remake(),
        ) from error
    found = _parsed(text, path, public_path)
    if not stopping and not holds(public_path, found.der):
        with suppress(OSError):  # it is for people, and no connection needs it
            write_whole(public_path, found.der)
            sync_folder(path.parent)
    return found


def own_certificate(*, stopping: bool = False) -> OwnCertificate:
    """Return this computer's certificate; the first call makes it.

    Args:
        stopping: As of :func:`find_own_certificate`.

    Raises:
        ConfigError: It cannot be read or made, is damaged, or others may read it.
    """
    return find_own_certificate(stopping=stopping) or make_own_certificate()


def make_own_certificate(*, replace: bool = False) -> OwnCertificate:
    """Make this computer's certificate.

    Of two programs that make it at once, both use that of the first.

    Args:
        replace: Whether one that is there already may go.

    Raises:
        ConfigError: It cannot be stored.
    """
    from cryptography import x509
    from cryptography.hazmat.primitives.asymmetric import rsa
    from cryptography.x509.oid import ExtendedKeyUsageOID

    from robolink.files.certificates import (
        OPCUA_APPLICATION,
        CertificatePurpose,
        certificate_as_pem,
        key_as_pem,
        self_signed,
    )

    path, _ = own_files()
    host = re.sub(r"[^a-z0-9.-]+", "-", platform.node().lower()).strip("-.") or "localhost"
    key = rsa.generate_private_key(public_exponent=65537, key_size=_KEY_BITS)
    names = [x509.UniformResourceIdentifier(f"urn:{host}:robolink"), x509.DNSName(host)]
    purpose = CertificatePurpose(
        f"robolink on {host}",
        names,
        OPCUA_APPLICATION,
        [ExtendedKeyUsageOID.CLIENT_AUTH],
        VALID_DAYS,
    )
    certificate = self_signed(key, purpose)
    try:
        make_folder(path.parent)
        write_whole(path, key_as_pem(key) + certificate_as_pem(certificate), replace=replace)
        sync_folder(path.parent)
    except FileExistsError:
        pass  # another program was faster
    except OSError as error:
        raise ConfigError(
            tr("{path} cannot be written: {cause}.", path=path, cause=error.strerror or error),
            remedy=tr("No certificate was made."),
        ) from error
    made = find_own_certificate()
    if made is None:
        raise ConfigError(tr("{path} is gone again.", path=path), remedy=_remake())
    return made


def _parsed(text: bytes, path: Path, public_path: Path) -> OwnCertificate:
    from cryptography import x509
    from cryptography.exceptions import InvalidSignature, UnsupportedAlgorithm
    from cryptography.hazmat.primitives import hashes
    from cryptography.hazmat.primitives.asymmetric import padding, rsa
    from cryptography.hazmat.primitives.serialization import Encoding, load_pem_private_key

    from robolink.files.certificates import fingerprint_of, key_as_pem

    try:
        # It is our own: that it signs for its certificate takes a hundredth of the time of testing
        # its numbers for primes, which a stop would wait for too.
        key = load_pem_private_key(text, password=None, unsafe_skip_rsa_key_validation=True)
        certificate = x509.load_pem_x509_certificate(text)
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        (uri,) = names.get_values_for_type(x509.UniformResourceIdentifier)
        public_key = certificate.public_key()
        if not (isinstance(key, rsa.RSAPrivateKey) and isinstance(public_key, rsa.RSAPublicKey)):
            raise ValueError(path)
        how = padding.PKCS1v15(), hashes.SHA256()
        public_key.verify(key.sign(text, *how), text, *how)
        pem = key_as_pem(key)
    except (
        ValueError,
        TypeError,
        InvalidSignature,
        UnsupportedAlgorithm,
        x509.ExtensionNotFound,
    ) as error:
        raise ConfigError(
            tr("{path} holds no certificate with its key.", path=path), remedy=_remake()
        ) from error
    return OwnCertificate(
        der=certificate.public_bytes(Encoding.DER),
        key=pem,
        application_uri=uri,
        fingerprint=fingerprint_of(certificate),
        begins=certificate.not_valid_before_utc,
        ends=certificate.not_valid_after_utc,
        path=path,
        public_path=public_path,
    )


def _remake() -> str:
    return tr(
        "To make a new one: {command}. Then trust it at each PLC.",
        command=remedy_word(RemedyWord.RENEW_CERTIFICATE),
    )
