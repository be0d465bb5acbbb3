"""Bringing an EPSON controller to rest, whoever made it move.

Abort ends what Execute runs, also when the Execute came from a session that is gone; Stop ends
tasks (epson.md 1.2). Neither answer says that the arm stands: a status without Running does. So
both are sent, in this order, because only Abort is served while a statement runs, and then the
status is read until it shows rest.
"""

from typing import Final

from robolink.controllers.epson._session import EpsonSession
from robolink.errors import OutcomeUnknownError, RejectedError
from robolink.messages import tr
from robolink.protocols.epson_text import parse_status
from robolink.timing import Deadline

REST_S: Final = 5.0
"""Longest time from the stop to a status that shows rest."""

_LOOK_S: Final = 0.05


def bring_to_rest(session: EpsonSession) -> None:
    """Send Abort and Stop, and wait for a status that shows rest; from any thread.

    Raises:
        OutcomeUnknownError: No such status came in time.
        TransportError, RemoteProtocolError: The session is over; rest was not seen.
    """
    deadline = Deadline.after(session.clock, REST_S)
    _ask(session, "Abort")
    stopped = False
    while True:
        # Stop is refused while a statement runs, so it waits for the answer of that one.
        pending = session.pending
        if not stopped and (pending is None or pending.answer is not None):
            _ask(session, "Stop")
            stopped = True
        if stopped and not _running(session):
            return
        if deadline.expired:
            raise OutcomeUnknownError(
                tr("The controller was told to stop, and its status still shows that it runs."),
                controller=session.identity,
                request="Abort, Stop",
            )
        if stopped:
            session.clock.sleep(_LOOK_S)
        else:
            session.await_pending(wait_s=_LOOK_S)


def _ask(session: EpsonSession, request: str) -> None:
    """Ask for a stop. A refusal is no news: what counts is whether the arm stands."""
    try:
        session.exchange(request)
    except RejectedError:
        return


def _running(session: EpsonSession) -> bool:
    return parse_status(session.exchange("GetStatus"))[0].running
