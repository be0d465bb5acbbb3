"""What a connection to an OPC UA server is protected by.

Source: OPC 10000-4, 7.41 (endpoints and user tokens); docs/security.md.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.transport._url import LinkUrl, UrlOptions

if TYPE_CHECKING:
    from robolink.model import Secret

NO_SECURITY: Final = "none"

POLICIES: Final[Mapping[str, str]] = {
    name: name
    for name in ("Basic256Sha256", "Aes128Sha256RsaOaep", "Aes256Sha256RsaPss", NO_SECURITY)
}
"""Names that the URL option ``security`` takes; all but the last sign and encrypt."""

_FINGERPRINT_DIGITS: Final = 64


@dataclass(frozen=True, slots=True)
class OpcuaSecurity:
    """How one connection is signed, encrypted and logged in.

    Attributes:
        policy: One of :data:`POLICIES`.
        own_certificate: Certificate of this application, DER; empty without security.
        own_key: Its private key, PEM (PKCS 8) without a password; empty without security.
        application_uri: The URI in that certificate; a server compares the two.
        pinned_fingerprint: SHA-256 of the server's certificate, 64 small hexadecimal digits.
        user: Name of the user; empty for an anonymous session.
        password: Of that user.
        write_unsecured: Whether a person allowed writes by name although nobody is logged in, or
            nothing is signed and encrypted.
        any_date: Whether the server's certificate may have ended, or not have begun.
    """

    policy: str = NO_SECURITY
    own_certificate: bytes = field(default=b"", repr=False)
    own_key: bytes = field(default=b"", repr=False)
    application_uri: str = "urn:robolink"
    pinned_fingerprint: str = ""
    user: str = ""
    password: str = field(default="", repr=False)
    write_unsecured: bool = False
    any_date: bool = False

    @property
    def secured(self) -> bool:
        """Whether all is signed and encrypted, to a server whose certificate was compared."""
        return self.policy != NO_SECURITY and bool(self.pinned_fingerprint)

    @property
    def may_write(self) -> bool:
        """Whether this connection may write: secured and logged in, or allowed by name."""
        return self.write_unsecured or (self.secured and bool(self.user))


def take_security(options: UrlOptions) -> OpcuaSecurity:
    """Take the options of an ``opcua`` URL that say how the connection is protected.

    Args:
        options: ``security`` (one of :data:`POLICIES`), ``server_certificate`` (SHA-256 of the
            server's certificate), ``user``, ``write_unsecured`` (``yes``).

    Raises:
        ConfigError: An option makes no sense.
    """
    return OpcuaSecurity(
        policy=options.take_choice("security", "Basic256Sha256", POLICIES),
        pinned_fingerprint=_fingerprint(options.take_text("server_certificate")),
        user=options.take_text("user"),
        write_unsecured=options.take_choice("write_unsecured", "no", {"no": False, "yes": True}),
    )


def protection_remark(url: LinkUrl) -> str:
    """Return what a person should know of how a connection is protected; empty where all is well.

    Args:
        url: Of a controller; of all but OPC UA nothing is said, since none of them has a choice.
    """
    if url.medium != "opcua":
        return ""
    encrypted = url.options.get("security") != NO_SECURITY
    if encrypted and url.options.get("user"):
        return ""
    if url.options.get("write_unsecured") != "yes":
        if encrypted:
            return tr("Nobody logs in over OPC UA, so robolink only reads and stops.")
        return tr("OPC UA without encryption, so robolink only reads and stops.")
    if encrypted:
        return tr(
            "Nobody logs in over OPC UA, and write_unsecured=yes lets robolink write all the same."
        )
    return tr(
        "OPC UA WITHOUT ENCRYPTION: anybody in this network can read and change what is sent, and "
        "write_unsecured=yes lets robolink write all the same."
    )


def completed(
    security: OpcuaSecurity, password: "Secret | None", identity: str, *, stopping: bool
) -> OpcuaSecurity:
    """Return the same with the certificate of this computer, and with the user's password.

    Nothing is sent; what would show a password, or would not protect what it seems to, is refused.

    Args:
        security: What the URL says.
        password: As it was found in the usual places.
        identity: Names the far end in errors.
        stopping: Whether this is for a stop, which neither a certificate's date nor the mode of
            the key's file holds back.

    Raises:
        ConfigError: A user or a pinned certificate without encryption, a user without a password,
            or this computer's certificate cannot be used.
    """
    if security.policy == NO_SECURITY:
        if security.user or security.pinned_fingerprint:
            raise ConfigError(
                tr(
                    "security=none protects nothing: it compares no certificate, and no password "
                    "is sent without encryption."
                ),
                remedy=tr("Leave out security=none, or both server_certificate and user."),
                controller=identity,
            )
        return security
    if security.user and not password:
        raise ConfigError(
            tr(
                "There is no password for {user} at {identity}.",
                user=security.user,
                identity=identity,
            ),
            remedy=tr("Give it by {password}.", password=remedy_word(RemedyWord.PASSWORD)),
            controller=identity,
        )
    # Here, because nothing else needs a certificate.
    from robolink.transport.opcua.own_certificate import own_certificate

    own = own_certificate(stopping=stopping)
    if not stopping:
        own.require_in_force()
    return replace(
        security,
        own_certificate=own.der,
        own_key=own.key,
        application_uri=own.application_uri,
        password=password.reveal() if security.user and password else "",
        any_date=stopping,
    )


def fingerprint_digits(text: str) -> str | None:
    """Return the 64 digits of a SHA-256 fingerprint, small; ``None`` where a text is none."""
    digits = "".join(text.split()).replace(":", "").lower()
    fits = len(digits) == _FINGERPRINT_DIGITS and not set(digits) - set("0123456789abcdef")
    return digits if fits else None


def _fingerprint(text: str) -> str:
    digits = fingerprint_digits(text) if text else ""
    if digits is None:
        raise ConfigError(
            tr("server_certificate={text} is no SHA-256 fingerprint.", text=text),
            remedy=tr("It has 64 hexadecimal digits; colons and spaces between them are allowed."),
        )
    return digits
