"""Certificates that sign themselves, for programs that have no authority behind them.

The one place that makes certificates: the panel's, which tablets compare by its fingerprint, and
that of the OPC UA client, which a PLC's engineer trusts by hand. They are leaves and no
authorities: whoever steals a key can pretend to be its owner, and nobody else.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa
from cryptography.x509.oid import NameOID, ObjectIdentifier

from robolink.timing import wall_time

PrivateKey = ec.EllipticCurvePrivateKey | rsa.RSAPrivateKey

_BACKDATED: Final = timedelta(hours=1)
"""The far end's clock may be behind this computer's."""
_MOST_NAME: Final = 64
"""Longest common name of X.509, in characters."""

SIGNING: Final = frozenset({"digital_signature"})
OPCUA_APPLICATION: Final = frozenset(
    {
        "digital_signature",
        "content_commitment",
        "key_encipherment",
        "data_encipherment",
        "key_cert_sign",
    }
)
"""OPC 10000-6 table 43; the last one for certificates that sign themselves."""
_USAGES: Final = frozenset(
    {
        "digital_signature",
        "content_commitment",
        "key_encipherment",
        "data_encipherment",
        "key_agreement",
        "key_cert_sign",
        "crl_sign",
        "encipher_only",
        "decipher_only",
    }
)


@dataclass(frozen=True, slots=True)
class CertificatePurpose:
    """What a certificate is for.

    Attributes:
        called: Its common name, cut to what X.509 takes.
        names: Its subject alternative names.
        uses: Names of its key usages, as RFC 5280 4.2.1.3 has them, in small letters.
        extended: Its extended key usages.
        days: For how many days it counts.
    """

    called: str
    names: Sequence[x509.GeneralName]
    uses: frozenset[str]
    extended: Sequence[ObjectIdentifier]
    days: int


def self_signed(
    key: PrivateKey, purpose: CertificatePurpose, *, begins: datetime | None = None
) -> x509.Certificate:
    """Return a new certificate, signed with its own key.

    Args:
        key: The key.
        purpose: What it is for.
        begins: From when it counts; by default from an hour ago.
    """
    begins = begins or wall_time() - _BACKDATED
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, purpose.called[:_MOST_NAME])])
    identifier = x509.SubjectKeyIdentifier.from_public_key(key.public_key())
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(subject)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(begins)
        .not_valid_after(begins + timedelta(days=purpose.days))
        .add_extension(x509.SubjectAlternativeName(purpose.names), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(
            x509.KeyUsage(**{usage: usage in purpose.uses for usage in _USAGES}), critical=True
        )
        .add_extension(x509.ExtendedKeyUsage(purpose.extended), critical=False)
        .add_extension(identifier, critical=False)
        .add_extension(
            x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(identifier),
            critical=False,
        )
        .sign(key, hashes.SHA256())
    )


def key_as_pem(key: PrivateKey) -> bytes:
    """Return a key as it is stored: without a password, for nobody can be asked for one."""
    return key.private_bytes(
        serialization.Encoding.PEM,
        serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption(),
    )


def certificate_as_pem(certificate: x509.Certificate) -> bytes:
    """Return a certificate as it is stored."""
    return certificate.public_bytes(serialization.Encoding.PEM)


def fingerprint_of(certificate: x509.Certificate) -> str:
    """Return the SHA-256 of a certificate as browsers and servers show it: AA:BB:..."""
    return certificate.fingerprint(hashes.SHA256()).hex(":").upper()


def certificate_of(text: bytes) -> x509.Certificate:
    """Return the first certificate of a text, PEM or DER.

    Raises:
        ValueError: It is none.
    """
    if text.lstrip().startswith(b"-----BEGIN"):
        return x509.load_pem_x509_certificate(text)
    return x509.load_der_x509_certificate(text)
