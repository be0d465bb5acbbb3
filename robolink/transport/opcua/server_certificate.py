"""A server's certificate, as a person compares it once and robolink holds it against a pin.

No authority stands behind it: what counts is that a person compared its fingerprint with what the
PLC itself shows. Its names and dates are told; only its dates are held against it later.
"""

import hashlib
import warnings
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes
from cryptography.x509.oid import NameOID

from robolink.errors import ConfigError, RemoteProtocolError
from robolink.messages import tr
from robolink.timing import wall_time
from robolink.transport.opcua.security import OpcuaSecurity

SOON: Final = timedelta(days=60)
"""For so long before its end it is said."""

_MOST_TEXT: Final = 200


@dataclass(frozen=True, slots=True)
class OfferedCertificate:
    """What it says.

    Attributes:
        name: Its common name.
        application_uri: The URI by which OPC UA knows the server; empty for none.
        hosts: Names and addresses of computers in it.
        digits: SHA-256, 64 small hexadecimal digits.
        thumbprint: SHA-1, 40 such digits: OPC UA's own name of a certificate, and the only one
            that some tools show. Nobody is known to be able to make another certificate with it.
        begins, ends: From when until when it counts.
    """

    name: str
    application_uri: str
    hosts: tuple[str, ...]
    digits: str
    thumbprint: str
    begins: datetime
    ends: datetime

    @property
    def fingerprint(self) -> str:
        """As the PLC's tools show it, and as a cell file keeps it: AA:BB:..."""
        return grouped_by_colon(self.digits)

    def remarks(self, host: str) -> tuple[str, ...]:
        """Return what a person should know of it before it is kept.

        Args:
            host: As the URL calls the server.
        """
        found = []
        now = wall_time()
        if host.lower() not in (name.lower() for name in self.hosts):
            names = ", ".join(self.hosts) or tr("no computer")
            found.append(
                tr("It is made out to {names}, and not to {host}.", names=names, host=host)
            )
        if now < self.begins:
            found.append(tr("It counts only from {day}.", day=self.begins.date()))
        elif now > self.ends:
            found.append(tr("It ended on {day}.", day=self.ends.date()))
        elif self.ends_soon:
            found.append(tr("It ends on {day}.", day=self.ends.date()))
        return tuple(found)

    @property
    def ends_soon(self) -> bool:
        """Whether somebody should see to a new one."""
        return wall_time() > self.ends - SOON

    def require_in_force(self, identity: str) -> None:
        """Refuse one that does not count today.

        Raises:
            ConfigError: Its time is over or has not begun.
        """
        if not self.begins <= wall_time() <= self.ends:
            raise ConfigError(
                tr(
                    "The certificate of {identity} counts from {begin} to {end}.",
                    identity=identity,
                    begin=self.begins.date(),
                    end=self.ends.date(),
                ),
                remedy=tr(
                    "Check the clocks of this computer and of the PLC, or make a new certificate "
                    "there. Then compare it: robolink cell trust"
                ),
                controller=identity,
            )


def require_pinned(certificate: bytes, security: OpcuaSecurity, identity: str) -> None:
    """Refuse a server whose certificate is not the one that a person compared.

    Args:
        certificate: As the server shows it, DER.
        security: Holds the pin, and whether dates count.
        identity: Names the server in errors.

    Raises:
        ConfigError: None was compared, this is another one, or its time is over or has not begun.
        RemoteProtocolError: It is no certificate.
    """
    found = hashlib.sha256(certificate).hexdigest()
    if not security.pinned_fingerprint:
        raise ConfigError(
            tr(
                "Nobody has compared the certificate of {identity} yet. Its fingerprint: {found}.",
                identity=identity,
                found=grouped_by_colon(found),
            ),
            remedy=tr("Compare it at the PLC and keep it: robolink cell trust"),
            controller=identity,
        )
    if found != security.pinned_fingerprint:
        raise ConfigError(
            tr(
                "{identity} has another certificate than the one that was compared: {found}, not "
                "{pinned}.",
                identity=identity,
                found=grouped_by_colon(found),
                pinned=grouped_by_colon(security.pinned_fingerprint),
            ),
            remedy=tr(
                "Something may stand between this computer and the PLC: find out what. If the PLC "
                "got a new certificate, compare it there and keep it: robolink cell trust"
            ),
            controller=identity,
        )
    if not security.any_date:
        read_server_certificate(certificate, identity).require_in_force(identity)


def grouped_by_colon(digits: str) -> str:
    """Return a fingerprint as tools show it: AA:BB:..."""
    return ":".join(digits[at : at + 2].upper() for at in range(0, len(digits), 2))


def read_server_certificate(der: bytes, identity: str) -> OfferedCertificate:
    """Return what a certificate says.

    Args:
        der: As the server sent it.
        identity: Names the server in errors.

    Raises:
        RemoteProtocolError: It is none.
    """
    try:
        found = x509.load_der_x509_certificate(der)
        called = _common_name(found)
        try:
            names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        except x509.ExtensionNotFound:
            uris, hosts = [], []
        else:
            uris = names.get_values_for_type(x509.UniformResourceIdentifier)
            hosts = names.get_values_for_type(x509.DNSName)
            hosts += map(str, names.get_values_for_type(x509.IPAddress))
        return OfferedCertificate(
            name=_plain(called),
            application_uri=_plain(uris[0]) if uris else "",
            hosts=tuple(map(_plain, hosts)),
            digits=found.fingerprint(hashes.SHA256()).hex(),
            thumbprint=found.fingerprint(hashes.SHA1()).hex(),
            begins=found.not_valid_before_utc,
            ends=found.not_valid_after_utc,
        )
    except (ValueError, x509.DuplicateExtension) as error:
        raise RemoteProtocolError(
            tr("What {identity} sent as its certificate is none.", identity=identity),
            remedy=tr("Check that this is the port of its OPC UA server, usually 4840."),
            raw=der[:256],
        ) from error


def _common_name(certificate: x509.Certificate) -> str:
    """Return whom it is made out to; empty where it does not say.

    Eclipse Milo leaves the country empty, of which cryptography would warn the user each time.
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "Attribute's length", UserWarning)
        common = certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)
    return str(common[0].value) if common else ""


def _plain(text: str) -> str:
    """Return a text of a stranger without what could control a terminal."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)[:_MOST_TEXT]
