"""From a URL, or an open transport, to a logged-in EPSON controller."""

from contextlib import suppress

from robolink.controllers.epson.controller import EpsonController
from robolink.controllers.epson.link.session import EpsonSession
from robolink.controllers.registry import ConnectionTerms
from robolink.errors import JournalError, LoginUnansweredError
from robolink.model import Controller, OutcomeLog, Secret
from robolink.transport import LinkUrl, TracingTransport, Transport, open_transport


def open_epson_url(url: LinkUrl, terms: ConnectionTerms, /) -> Controller:
    """Connect to the controller at a URL; see :class:`~robolink.controllers.ControllerOpener`.

    Raises:
        LeaseHeldError: Nobody answers the login, and somebody else has the controller.
        RobolinkError: As :func:`open_epson`, and as the transport.
    """
    transport = open_transport(url, timeout_s=terms.timeout_s, clock=terms.clock)
    outcomes = terms.record_of(transport)
    try:
        return open_epson(
            transport if terms.trace is None else TracingTransport(transport, terms.trace),
            outcomes=outcomes,
            password=terms.password,
            timeout_s=terms.timeout_s,
            remote_timeout_s=terms.remote_timeout_s,
        )
    except LoginUnansweredError:
        # One client at a time is served (docs/reference/epson.md 1.1). The lease may say who that
        # is, if the journal can be read.
        with suppress(JournalError):
            outcomes.look()
        raise


def open_epson(
    transport: Transport,
    *,
    outcomes: OutcomeLog,
    password: Secret | None = None,
    timeout_s: float = 3.0,
    remote_timeout_s: float = 60.0,
) -> EpsonController:
    """Log in and return the controller; the transport is closed when that fails.

    Raises:
        LoginRefusedError: Wrong or missing password. One attempt is made.
        LoginUnansweredError: Nobody answers; another client may be logged in.
    """
    session = EpsonSession(transport, timeout_s=timeout_s)
    try:
        session.login(password)
    except BaseException:
        session.close()
        raise
    return EpsonController(session, outcomes, remote_timeout_s=remote_timeout_s)
