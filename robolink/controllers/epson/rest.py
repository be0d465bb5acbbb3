"""Stops an EPSON controller and confirms that it has stopped.

Abort ends what Execute runs, whoever began it: also the Execute of a client that has died,
which goes on without it where the controller's remote time-out is long
(docs/reference/epson.md 1.7). Stop ends tasks. While an Execute runs only Abort and GetStatus are
served (docs/reference/epson.md 1.5), so a Stop that was accepted shows, beside the Running flag,
that no Execute is left: whether the flag is on during an Execute is not documented.

It needs a line and a clock; nothing here looks at a record or a file, and nothing is
imported that the first frame of a stop does not need.
"""

from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Final

from robolink.controllers.stop_attempts import StopMeans, tell_what_is_said_twice
from robolink.errors import (
    BusyError,
    Concerning,
    OutcomeUnknownError,
    RejectedError,
    RobolinkError,
)
from robolink.messages import tr
from robolink.protocols.epson_text import ErrorCode, Reply, StatusFlags, parse_status
from robolink.timing import Clock, Deadline
from robolink.transport import LinkUrl

if TYPE_CHECKING:
    from robolink.controllers.epson.line import EpsonConversation
    from robolink.model import ControllerStatus

REST_S: Final = 5.0
"""Longest time from the first Abort to a confirmed stop, in s (docs/reference/rules.md 5)."""

_POLL_S: Final = 0.02
_AGAIN_S: Final = 1.0
"""Time in s after which a movement that still goes on is aborted again: a stop may be repeated."""

Ask = Callable[[str], Reply]
"""Sends the request of that name and returns its reply; a refusal is a ``RejectedError``."""


def bring_to_rest(ask: Ask, clock: Clock, *, controller: str) -> tuple[StatusFlags, int]:
    """Send Abort, then Stop, and return the flags and the code that confirm the stop.

    Args:
        ask: Asks the controller.
        clock: The clock on which its time passes.
        controller: Its name in errors.

    Raises:
        RejectedError: The controller takes no Stop from here.
        OutcomeUnknownError: It does not come to rest within :data:`REST_S`.
        TransportError, RemoteProtocolError: The link is over; whether it stops is not known.
    """
    deadline = Deadline.after(clock, REST_S)
    stopped = False
    while not deadline.expired:
        _abort(ask)
        again = Deadline.after(clock, min(_AGAIN_S, deadline.remaining_s()))
        while True:
            stopped = stopped or _stop(ask)
            flags, code = parse_status(ask("GetStatus"))
            if stopped and not flags.running:
                return flags, code
            if again.expired:
                break
            clock.sleep(min(_POLL_S, again.remaining_s()))
    raise OutcomeUnknownError(
        tr(
            "{controller} accepted the stop, but did not confirm within {seconds:g} s that "
            "the robot has stopped.",
            controller=controller,
            seconds=REST_S,
        ),
        remedy=tr("It may still be moving."),
        controller=controller,
        request="Stop",
    )


def _abort(ask: Ask) -> None:
    # Older firmware has no Abort (docs/reference/epson.md 1.9); the Stop that follows decides.
    with suppress(RejectedError):
        ask("Abort")


def _stop(ask: Ask) -> bool:
    """Send Stop; False while an Execute that is being aborted blocks it."""
    try:
        ask("Stop")
    except BusyError:
        return False
    except RejectedError as error:
        if error.code != ErrorCode.EXECUTE_RUNNING:
            raise
        return False
    return True


def stop_over_new_link(link: LinkUrl, means: StopMeans) -> "ControllerStatus":
    """Log in, stop, and return the state that confirms it; one attempt.

    Args:
        link: Which controller.
        means: How it is reached.

    Raises:
        LoginRefusedError: The password is wrong.
        LoginUnansweredError: It serves another client.
        RobolinkError: As :func:`bring_to_rest`, and as the transport.
    """
    from robolink.controllers.epson.line import EpsonConversation, open_line

    opened = open_line(link, timeout_s=means.timeout_s, clock=means.clock)
    talk = EpsonConversation(opened, timeout_s=means.login_s)
    try:
        with Concerning(talk.identity):
            talk.login(means.password)
            talk.timeout_s = means.timeout_s
            now = bring_to_rest(talk.exchange, talk.clock, controller=talk.identity)
            from robolink.controllers.epson.answers import may_log_out, status_from_flags

            status = status_from_flags(*now)
            if means.met is not None:
                _tell_who(talk, means.met)
            if may_log_out(status):
                with suppress(RobolinkError):  # it has stopped: a failure here is harmless
                    talk.exchange("Logout")
            return status
    finally:
        talk.close()


def _tell_who(talk: "EpsonConversation", met: Callable[[str], None]) -> None:
    """Say which controller has stopped, if this firmware reports it without an Execute."""
    from robolink.controllers.epson.link import name_from

    def asked() -> str:
        number = talk.exchange("GetContNo").fields
        robots = talk.exchange("GetRobotSerial", "0").fields
        return name_from([text.strip() for text in number], [text.strip() for text in robots])

    tell_what_is_said_twice(asked, met)
