"""A session on a secure channel: who this program is, and who its user is.

What the server offers is asked on a connection of its own, unprotected, as OPC UA has it; what
counts is the certificate that was pinned, and that the channel is then opened for it.

Source: OPC 10000-4, 5.4 (discovery), 5.6 (channel), 5.7 (session), 7.40 (user tokens).
"""

from collections.abc import Callable
from typing import Any, Final, TypeVar

from asyncua import ua
from asyncua.common.utils import create_nonce
from asyncua.crypto import security_policies, uacrypto
from asyncua.crypto.security_policies import SecurityPolicy, SecurityPolicyNone
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from robolink.errors import (
    ConfigError,
    ConnectError,
    LoginRefusedError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.timing import Deadline
from robolink.transport.opcua import errors as errors
from robolink.transport.opcua.channel import SecureChannel
from robolink.transport.opcua.security import NO_SECURITY, OpcuaSecurity
from robolink.transport.opcua.server_certificate import require_pinned

_SESSION_TIMEOUT_MS: Final = 300_000
"""How long a server keeps a session without a request. Short, because a killed program leaves one,
and a PLC has few."""
_NONCE_BYTES: Final = 32
_NS_PER_MS: Final = 1_000_000
_CLOSED_WITHIN_S: Final = 0.5

_NO_LOGIN: Final = frozenset(
    {
        ua.StatusCodes.BadIdentityTokenInvalid,
        ua.StatusCodes.BadIdentityTokenRejected,
        ua.StatusCodes.BadUserAccessDenied,
        ua.StatusCodes.BadUserSignatureInvalid,
    }
)

_FULL: Final = frozenset(
    {
        ua.StatusCodes.BadMaxConnectionsReached,
        ua.StatusCodes.BadOutOfMemory,
        ua.StatusCodes.BadResourceUnavailable,
        ua.StatusCodes.BadTcpNotEnoughResources,
        ua.StatusCodes.BadTcpServerTooBusy,
        ua.StatusCodes.BadTooManySessions,
    }
)

_TOKEN_POLICIES: Final = frozenset(
    policy.URI
    for policy in (
        SecurityPolicyNone,
        security_policies.SecurityPolicyAes128Sha256RsaOaep,
        security_policies.SecurityPolicyAes256Sha256RsaPss,
        security_policies.SecurityPolicyBasic128Rsa15,
        security_policies.SecurityPolicyBasic256,
        security_policies.SecurityPolicyBasic256Sha256,
    )
)
"""Ways of encrypting a password that asyncua knows. Each is within a channel of a better one."""

_AnswerT = TypeVar("_AnswerT")

ChannelOpener = Callable[[SecurityPolicy, Deadline], SecureChannel]
"""Dials the server and returns a channel that is not yet open."""


class OpcuaSession:
    """One activated session, and its channel, which it owns.

    Args:
        channel: Open.
        identity: Names the far end in errors.
    """

    def __init__(self, channel: SecureChannel, identity: str) -> None:
        self._channel = channel
        self._identity = identity

    @property
    def place(self) -> str:
        """The address that answers, and its port."""
        return self._channel.transport.place

    def begin(self, security: OpcuaSecurity, deadline: Deadline) -> None:
        """Create and activate the session.

        Raises:
            ConfigError: The password would be sent unprotected.
            LoginRefusedError: The server does not let this user in.
            RejectedError, RemoteProtocolError, TransportError: As a channel.
        """
        created, endpoint = self._create(security, deadline)
        granted_ms = created.RevisedSessionTimeout
        if not 0 < granted_ms <= _SESSION_TIMEOUT_MS:  # a server that grants none, or more
            granted_ms = _SESSION_TIMEOUT_MS
        self._channel.idle_limit_ns = int(granted_ms * _NS_PER_MS)
        self._channel.authentication_token = created.AuthenticationToken
        policy = self._channel.policy
        request = ua.ActivateSessionRequest()
        asked = request.Parameters
        asked.ClientSignature.Algorithm = policy.AsymmetricSignatureURI or None
        asked.ClientSignature.Signature = policy.asymmetric_cryptography.signature(
            (policy.peer_certificate or b"") + (created.ServerNonce or b"")
        )
        asked.LocaleIds = ["en"]
        asked.UserIdentityToken = _user_token(
            self._identity, security, endpoint, policy, created.ServerNonce or b""
        )
        told = tr("log in as {user}", user=security.user or tr("anybody"))
        try:
            self.ask(request, ua.ActivateSessionResponse, deadline, told=told)
        except RejectedError as error:
            if error.code not in _NO_LOGIN:
                raise
            raise _no_login(self._identity, security.user, error) from error

    def ask(
        self,
        request: Any,  # noqa: ANN401 - asyncua's requests share no class
        answer: type[_AnswerT],
        deadline: Deadline,
        *,
        told: str,
        write: bool = False,
    ) -> _AnswerT:
        """See :meth:`SecureChannel.ask`."""
        return self._channel.ask(request, answer, deadline, told=told, write=write)

    def end(self) -> None:
        """Close session, channel and connection; what goes wrong with that is nobody's concern."""
        deadline = Deadline.after(self._channel.transport.clock, _CLOSED_WITHIN_S)
        try:
            request = ua.CloseSessionRequest()
            request.DeleteSubscriptions = True
            told = tr("close the session")
            self.ask(request, ua.CloseSessionResponse, deadline, told=told)
            self._channel.send_close(deadline)
        except RobolinkError:
            pass
        finally:
            self._channel.close()

    def drop(self) -> None:
        """Close the connection alone. Idempotent; any thread may call it at any time."""
        self._channel.close()

    def _create(
        self, security: OpcuaSecurity, deadline: Deadline
    ) -> tuple[ua.CreateSessionResult, ua.EndpointDescription]:
        policy = self._channel.policy
        request = ua.CreateSessionRequest()
        asked = request.Parameters
        asked.ClientDescription = ua.ApplicationDescription(
            ApplicationUri=security.application_uri,
            ProductUri="urn:robolink",
            ApplicationName=ua.LocalizedText("robolink"),
            ApplicationType=ua.ApplicationType.Client,
        )
        asked.EndpointUrl = self._channel.endpoint_url
        asked.SessionName = "robolink"
        asked.ClientNonce = create_nonce(_NONCE_BYTES)
        asked.ClientCertificate = policy.host_certificate
        asked.RequestedSessionTimeout = _SESSION_TIMEOUT_MS
        told = tr("create a session")
        created = self.ask(request, ua.CreateSessionResponse, deadline, told=told).Parameters
        if policy.peer_certificate:
            self._require_same_server(created, policy, asked.ClientNonce)
        return created, _matching(self._identity, created.ServerEndpoints, policy)

    def _require_same_server(
        self, created: ua.CreateSessionResult, policy: SecurityPolicy, nonce: bytes
    ) -> None:
        """Refuse a session of another server than the one whose certificate was pinned."""
        try:
            if _first_certificate(created.ServerCertificate or b"") != policy.peer_certificate:
                raise uacrypto.InvalidSignature
            policy.asymmetric_cryptography.verify(
                (policy.host_certificate or b"") + nonce, created.ServerSignature.Signature or b""
            )
        except uacrypto.InvalidSignature as error:
            raise RemoteProtocolError(
                tr(
                    "{identity} cannot show that its certificate is its own.",
                    identity=self._identity,
                ),
                remedy=tr("Something stands between this computer and the PLC: find out what."),
            ) from error


def open_session(
    dial: ChannelOpener, identity: str, security: OpcuaSecurity, deadline: Deadline
) -> OpcuaSession:
    """Open a channel as ``security`` asks for, and a session on it.

    Raises:
        ConfigError: A certificate or a pin is missing, or the server has another certificate.
        ConnectError: Nobody answers in time, or takes one more client.
        LoginRefusedError: The server does not let this user in.
        RejectedError: It refuses the session, or offers less than was asked for.
        RemoteProtocolError: What answers makes no sense.
    """
    try:
        return _opened(dial, identity, security, deadline)
    except (TransportTimeoutError, TransportBrokenError) as error:
        raise ConnectError(
            tr(
                "{identity} has a port, and nobody opens a session there. {cause}",
                identity=identity,
                cause=error.what,
            ),
            remedy=tr("Check that the PLC runs, and that this is its OPC UA server's port."),
            controller=identity,
        ) from error
    except RejectedError as error:
        if error.code not in _FULL:
            raise
        raise ConnectError(
            tr("{identity} takes no more clients. {cause}", identity=identity, cause=error.what),
            remedy=tr(
                "Close another client of the PLC; a session that was left open ends by itself."
            ),
            controller=identity,
        ) from error


def _opened(
    dial: ChannelOpener, identity: str, security: OpcuaSecurity, deadline: Deadline
) -> OpcuaSession:
    policy: SecurityPolicy = SecurityPolicyNone()
    if security.policy != NO_SECURITY:
        policy = _policy(
            identity, security, offered_certificate(dial, identity, security, deadline)
        )
    channel = dial(policy, deadline)
    session = OpcuaSession(channel, identity)
    try:
        channel.open(deadline)
        session.begin(security, deadline)
    except BaseException:
        session.drop()
        raise
    return session


def offered_certificate(
    dial: ChannelOpener, identity: str, security: OpcuaSecurity, deadline: Deadline
) -> bytes:
    """Return the certificate, DER, with which the server offers what ``security`` asks for.

    It is not compared with the pin here: whoever opens a channel to it does.

    Raises:
        RejectedError: It offers less than was asked for.
        RemoteProtocolError, TransportError: As a channel.
    """
    channel = dial(SecurityPolicyNone(), deadline)
    try:
        channel.open(deadline)
        request = ua.GetEndpointsRequest()
        request.Parameters.EndpointUrl = channel.endpoint_url
        told = tr("list its endpoints")
        endpoints = channel.ask(request, ua.GetEndpointsResponse, deadline, told=told).Endpoints
        channel.send_close(deadline)
    finally:
        channel.close()
    wanted = getattr(security_policies, f"SecurityPolicy{security.policy}")
    for endpoint in endpoints:
        if (
            endpoint.SecurityMode == ua.MessageSecurityMode.SignAndEncrypt
            and endpoint.SecurityPolicyUri == wanted.URI
            and endpoint.ServerCertificate
        ):
            return _first_certificate(endpoint.ServerCertificate)
    raise RejectedError(
        tr(
            "{identity} offers no signed and encrypted connection with {policy}.",
            identity=identity,
            policy=security.policy,
        ),
        remedy=tr(
            "Switch it on in the PLC. If it did offer it before, something stands in between: "
            "find out what. It offers: {offers}.",
            offers=", ".join(sorted({_offer(one) for one in endpoints})) or "-",
        ),
    )


def _offer(endpoint: ua.EndpointDescription) -> str:
    return f"{(endpoint.SecurityPolicyUri or '').rpartition('#')[2]} {endpoint.SecurityMode.name}"


def _policy(identity: str, security: OpcuaSecurity, certificate: bytes) -> SecurityPolicy:
    require_pinned(certificate, security, identity)
    if not (security.own_certificate and security.own_key):
        raise ConfigError(
            tr("This computer has no certificate of its own for OPC UA."),
            remedy=tr("Make one, then let the PLC trust it."),
            controller=identity,
        )
    wanted = getattr(security_policies, f"SecurityPolicy{security.policy}")
    made: SecurityPolicy = wanted(
        uacrypto.x509_from_der(certificate),
        uacrypto.x509_from_der(security.own_certificate),
        load_pem_private_key(security.own_key, None, unsafe_skip_rsa_key_validation=True),
        ua.MessageSecurityMode.SignAndEncrypt,
    )
    return made


def _first_certificate(der: bytes) -> bytes:
    """Return the first certificate of a chain: some servers send the chain in one piece."""
    return der[: int.from_bytes(der[2:4]) + 4] if der[:2] == b"\x30\x82" else der


def _matching(
    identity: str, endpoints: list[ua.EndpointDescription], policy: SecurityPolicy
) -> ua.EndpointDescription:
    """Return the endpoint that the session is on, as the channel itself tells it."""
    for endpoint in endpoints:
        if endpoint.SecurityMode == policy.Mode and endpoint.SecurityPolicyUri == policy.URI:
            return endpoint
    raise RemoteProtocolError(
        tr("{identity} does not list the endpoint that it answers on.", identity=identity),
        remedy=tr("Look at the settings and the log of the PLC's OPC UA server."),
    )


def _user_token(
    identity: str,
    security: OpcuaSecurity,
    endpoint: ua.EndpointDescription,
    policy: SecurityPolicy,
    nonce: bytes,
) -> Any:  # noqa: ANN401 - asyncua's tokens share no class
    wanted = ua.UserTokenType.UserName if security.user else ua.UserTokenType.Anonymous
    offered = [one for one in endpoint.UserIdentityTokens or () if one.TokenType == wanted]
    if not security.user:
        # CODESYS 3.5.21 offers endpoints without any token policy and lets anybody in (FUXA 2315).
        return ua.AnonymousIdentityToken(PolicyId=offered[0].PolicyId if offered else None)
    if not offered:
        raise RejectedError(
            tr("{identity} has no login by name and password here.", identity=identity),
            remedy=tr("Switch user names on in the PLC's OPC UA server, or leave the user out."),
        )
    known = [one for one in offered if (one.SecurityPolicyUri or policy.URI) in _TOKEN_POLICIES]
    if not known:
        raise RejectedError(
            tr(
                "{identity} takes passwords only encrypted with {policies}.",
                identity=identity,
                policies=", ".join(one.SecurityPolicyUri.rpartition("#")[2] for one in offered),
            ),
            remedy=tr("Switch Basic256Sha256 on for user names in the PLC's OPC UA server."),
        )
    token = ua.UserNameIdentityToken(PolicyId=known[0].PolicyId, UserName=security.user)
    uri = known[0].SecurityPolicyUri or policy.URI
    secret = security.password.encode()
    if uri != SecurityPolicyNone.URI and policy.peer_certificate:
        data, algorithm = security_policies.encrypt_asymmetric(
            uacrypto.x509_from_der(policy.peer_certificate).public_key(),
            ua.ua_binary.Primitives.Bytes.pack(secret + nonce),
            uri,
        )
        token.Password, token.EncryptionAlgorithm = data, algorithm
        return token
    if policy.Mode != ua.MessageSecurityMode.SignAndEncrypt:
        raise ConfigError(
            tr(
                "The password of {user} would be sent to {identity} unprotected.",
                user=security.user,
                identity=identity,
            ),
            remedy=tr("Leave security=none out of the URL, or leave the user out."),
            controller=identity,
        )
    token.Password = secret
    return token


def _no_login(identity: str, user: str, error: RejectedError) -> LoginRefusedError:
    if not user:
        return LoginRefusedError(
            tr("{identity} lets nobody in without a name: {cause}", identity=identity, cause=error),
            remedy=tr("Give a user in the URL or the cell file, and its password."),
        )
    return LoginRefusedError(
        tr("{identity} does not let {user} in: {cause}", identity=identity, user=user, cause=error),
        remedy=tr("Check name and password in the PLC's user management."),
    )
