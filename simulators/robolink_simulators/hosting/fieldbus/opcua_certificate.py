"""The certificate that a simulated OPC UA server shows: made when it is first needed."""

import socket
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from functools import cache
from ipaddress import ip_address

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import rsa
from cryptography.x509.oid import ExtendedKeyUsageOID

from robolink.files.certificates import OPCUA_APPLICATION, CertificatePurpose, self_signed

_VALID_DAYS = 400


@dataclass(frozen=True, slots=True)
class ServerCertificate:
    """A self-signed certificate with its key.

    Attributes:
        host: Address that clients connect to.
        application_uri: What names the server, in the certificate and in its description.
        certificate: The certificate.
        key: Its key, which never leaves the process.
    """

    host: str
    application_uri: str
    certificate: x509.Certificate
    key: rsa.RSAPrivateKey

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the certificate, in hexadecimal digits."""
        return self.certificate.fingerprint(hashes.SHA256()).hex()

    def expired(self) -> "ServerCertificate":
        """Return one of the same server and key that ended yesterday."""
        return make_certificate(self.host, expired=True)


@cache
def _key() -> rsa.RSAPrivateKey:
    """Return the key of all servers of this process; each certificate is another one."""
    return rsa.generate_private_key(public_exponent=65537, key_size=2048)


def make_certificate(host: str, *, expired: bool = False) -> ServerCertificate:
    """Make a certificate for a server, as OPC 10000-6 6.2.2 describes one.

    Args:
        host: Address that clients connect to.
        expired: Whether it ended yesterday.
    """
    uri = f"urn:{socket.gethostname()}:robolink:simulator"
    until = datetime.now(UTC) + timedelta(days=-1 if expired else 365)
    names: list[x509.GeneralName] = [x509.UniformResourceIdentifier(uri)]
    try:
        names.append(x509.IPAddress(ip_address(host)))
    except ValueError:
        names.append(x509.DNSName(host))
    key = _key()
    purpose = CertificatePurpose(
        "robolink simulator",
        names,
        OPCUA_APPLICATION,
        [ExtendedKeyUsageOID.SERVER_AUTH],
        _VALID_DAYS,
    )
    certificate = self_signed(key, purpose, begins=until - timedelta(days=_VALID_DAYS))
    return ServerCertificate(host, uri, certificate, key)
