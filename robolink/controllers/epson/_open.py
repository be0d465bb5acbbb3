"""From an open transport to a logged-in EPSON controller."""

from robolink.controllers.epson._controller import EpsonController
from robolink.controllers.epson._session import EpsonSession
from robolink.model import OutcomeLog, Secret
from robolink.transport import Transport


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
