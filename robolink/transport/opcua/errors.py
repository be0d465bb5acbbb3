"""Sentences for what goes wrong between this computer and an OPC UA server.

Names of status codes are those of OPC 10000-6, table A.2; they stand as the server's manual has
them, with what they mean.
"""

from typing import Final, NamedTuple

from robolink.errors import (
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.messages import tr

NOT_DONE: Final = frozenset(
    {
        "BadAttributeIdInvalid",
        "BadDecodingError",
        "BadEncodingLimitsExceeded",
        "BadIndexRangeInvalid",
        "BadIndexRangeNoData",
        "BadLocked",
        "BadNodeIdInvalid",
        "BadNodeIdUnknown",
        "BadNothingToDo",
        "BadNotSupported",
        "BadNotWritable",
        "BadOutOfRange",
        "BadRequestTooLarge",
        "BadSecurityChecksFailed",
        "BadSecurityModeInsufficient",
        "BadServiceUnsupported",
        "BadTooManyOperations",
        "BadTypeMismatch",
        "BadUserAccessDenied",
        "BadWriteNotSupported",
    }
)
"""Status codes after which a write was certainly not carried out."""

_ENDED: Final = frozenset(
    {
        "BadConnectionClosed",
        "BadSecureChannelClosed",
        "BadSecureChannelIdInvalid",
        "BadSecureChannelTokenUnknown",
        "BadServerHalted",
        "BadSessionClosed",
        "BadSessionIdInvalid",
        "BadSessionNotActivated",
        "BadShutdown",
        "BadTcpSecureChannelUnknown",
    }
)
"""Status codes of a whole answer that mean that channel or session have ended."""


class ReportedStatus(NamedTuple):
    """A status code: its number, its name in OPC UA, and what that says of it."""

    code: int
    name: str
    meaning: str


_DISTRUST: Final = ("BadCertificate", "BadSecurityChecksFailed")
"""How the status codes begin that a server has for a client's certificate. The second is all that
it says where it does not tell strangers why (OPC 10000-4, 6.1.3)."""


def read_of(node: str) -> str:
    """Return a read for display."""
    return tr("read {node}", node=node)


def write_of(node: str) -> str:
    """Return a write for display."""
    return tr("write {node}", node=node)


def unanswered(identity: str, request: str) -> TransportTimeoutError:
    """Return the error for an answer that did not come, or not whole."""
    return TransportTimeoutError(
        tr("{identity} did not answer: {request}.", identity=identity, request=request),
        remedy=tr("Check that the PLC runs and its OPC UA server with it, then try again."),
        request=request,
    )


def hung_up(identity: str) -> TransportBrokenError:
    """Return the error for a server that ended the connection."""
    return TransportBrokenError(
        tr("{identity} closed the connection.", identity=identity),
        remedy=tr(
            "Its number of sessions may be limited, or it has restarted: close other clients, "
            "then connect again."
        ),
    )


def unintelligible(identity: str, cause: object, raw: bytes = b"") -> RemoteProtocolError:
    """Return the error for bytes that are no OPC UA, or not what was asked for."""
    return RemoteProtocolError(
        tr("What {identity} sent makes no sense: {cause}.", identity=identity, cause=cause),
        remedy=tr("Check that this is the port of its OPC UA server, usually 4840."),
        raw=raw,
    )


def idle_too_long(identity: str, idle_s: float) -> TransportBrokenError:
    """Return the error for a session or channel that the server has given up meanwhile."""
    return TransportBrokenError(
        tr(
            "Nothing was asked of {identity} for {idle_s:.0f} s, so it ended the session.",
            identity=identity,
            idle_s=idle_s,
        ),
        remedy=tr("Connect again."),
    )


def ended(identity: str, status: ReportedStatus, request: str) -> TransportBrokenError:
    """Return the error for a server that says that channel or session have ended."""
    return TransportBrokenError(
        tr("{identity} ended the session: {name}.", identity=identity, name=status.name),
        remedy=tr("Connect again."),
        request=request,
    )


def refused_service(
    identity: str, status: ReportedStatus, request: str, *, write: bool
) -> RobolinkError:
    """Return the error for a whole request that the server refused with a status code."""
    if status.name in _ENDED:
        return ended(identity, status, request)
    if status.name in ("BadTimeout", "BadRequestTimeout"):
        return unanswered(identity, request)
    if write and status.name not in NOT_DONE:
        return left_open(identity, request, status)
    remedy = tr("Look at the settings and the log of the PLC's OPC UA server.")
    if status.name.startswith(_DISTRUST):
        remedy = tr(
            "Let the PLC trust this computer's certificate, then try again. To show it: "
            "robolink cell certificate"
        )
    return _refused(identity, request, status, remedy)


def _refused(identity: str, request: str, status: ReportedStatus, remedy: str) -> RejectedError:
    return RejectedError(
        tr(
            "{identity} refused: {request}. {name}: {meaning}",
            identity=identity,
            request=request,
            name=status.name,
            meaning=status.meaning,
        ),
        code=status.code,
        remedy=remedy,
        request=request,
    )


def left_open(identity: str, request: str, status: ReportedStatus) -> RemoteProtocolError:
    """Return the error for a write of which the server does not say whether it was done."""
    return RemoteProtocolError(
        tr(
            "{identity} does not say whether this was done: {request}. {name}: {meaning}",
            identity=identity,
            request=request,
            name=status.name,
            meaning=status.meaning,
        ),
        remedy=tr("Connect again and read the value before anything else."),
        request=request,
    )


def refused_node(
    identity: str, node: str, status: ReportedStatus, *, write: bool
) -> RejectedError | RemoteProtocolError:
    """Return the error for one node that could not be read or written."""
    request = write_of(node) if write else read_of(node)
    if write and status.name not in NOT_DONE:
        return left_open(identity, request, status)
    remedy = tr("Check in the PLC that this variable is among its symbols, and what may use it.")
    if status.name in ("BadNodeIdUnknown", "BadNodeIdInvalid"):
        remedy = tr("Compare the name with those that the server has: its program may be another.")
    return _refused(identity, request, status, remedy)


def changed_type(identity: str, node: str, due: str, found: str) -> RemoteProtocolError:
    """Return the error for a node that is no longer what it was, or not what it has to be."""
    return RemoteProtocolError(
        tr(
            "{node} of {identity} is {found}, and was or has to be {due}.",
            identity=identity,
            node=node,
            due=due,
            found=found,
        ),
        remedy=tr("The PLC has another program: compare its declaration, then connect again."),
        request=read_of(node),
    )


def torn(identity: str, request: str, answers: int) -> RemoteProtocolError:
    """Return the error for a value that had parts of two PLC cycles in each answer."""
    return RemoteProtocolError(
        tr(
            "{identity} mixed two PLC cycles in each of {answers} answers: {request}.",
            identity=identity,
            answers=answers,
            request=request,
        ),
        remedy=tr(
            "Connect again. If this persists, check that only the mailbox program writes this "
            "variable, and that the PLC has time left for its OPC UA server."
        ),
        request=request,
    )
