"""Bringing an EPSON controller to rest, and knowing that it rests.

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
from typing import Final

from robolink.controllers.epson.line import PASSWORD_REFUSALS, EpsonLine, refused, unanswered
from robolink.errors import (
    BusyError,
    OutcomeUnknownError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.protocols import NEED_DATA
from robolink.protocols.epson_text import (
    EndOfStream,
    ErrorCode,
    Refusal,
    Reply,
    Request,
    StatusFlags,
    parse_status,
)
from robolink.timing import Clock, Deadline

REST_S: Final = 5.0
"""Longest time from the first Abort to a state that shows rest (docs/reference/rules.md 5)."""

_POLL_S: Final = 0.02
_AGAIN_S: Final = 1.0
"""A movement that still goes on after this long is aborted again: stopping may be repeated."""

Ask = Callable[[str], Reply]
"""Sends the request of that name and returns its reply; a refusal is a ``RejectedError``."""


def bring_to_rest(ask: Ask, clock: Clock, *, controller: str) -> tuple[StatusFlags, int]:
    """Send Abort, then Stop, and return the flags and the code that show rest.

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
            "{controller} took the stop, but did not come to rest within {seconds:g} s.",
            controller=controller,
            seconds=REST_S,
        ),
        remedy=tr("It may still be moving."),
        controller=controller,
        request="Stop",
    )


def _abort(ask: Ask) -> None:
    # Older firmware has none (docs/reference/epson.md 1.9); the Stop that follows tells what is so.
    with suppress(RejectedError):
        ask("Abort")


def _stop(ask: Ask) -> bool:
    """Send Stop; False while an Execute that is being aborted is in its way."""
    try:
        ask("Stop")
    except BusyError:
        return False
    except RejectedError as error:
        if error.code != ErrorCode.EXECUTE_RUNNING:
            raise
        return False
    return True


_STRAYS = 16
"""More answers than this to questions that nobody asked are no controller's."""


class StopLine:
    """One connection that does nothing but stop, from the login to the controller's rest.

    It is not a session: there is no record beside it, nothing of its own can be pending, and what
    turns up unasked, such as the late answer to the Execute that it ends, is passed over.

    Args:
        line: An open line; it is owned from here on.
        timeout_s: Longest wait for one answer.
    """

    def __init__(self, line: EpsonLine, *, timeout_s: float) -> None:
        self._line = line
        self._transport = line.transport
        self._timeout_s = timeout_s
        self._codec = line.codec

    def login(self, password: str) -> None:
        """Log in. One attempt.

        Raises:
            LoginRefusedError: The password is wrong, or one is demanded.
            LoginUnansweredError: Nobody answers; most likely another client is logged in.
        """
        identity = self._transport.identity
        try:
            self._ask(Request("Login", (password,)), secret=True)
        except (TransportTimeoutError, TransportBrokenError) as error:
            raise unanswered(identity) from error
        except RejectedError as error:
            if error.code in PASSWORD_REFUSALS:
                raise refused(error.code, identity) from error
            raise

    def stop(self) -> tuple[StatusFlags, int]:
        """Bring the controller to rest; see :func:`.bring_to_rest`."""
        return bring_to_rest(
            lambda name: self._ask(Request(name)),
            self._transport.clock,
            controller=self._transport.identity,
        )

    def who(self) -> str:
        """Ask, now that it stands, who the controller is; it is asked for nothing else.

        Returns:
            Its name, empty where this firmware tells none without an Execute.
        """
        from robolink.controllers.epson.link import name_from

        try:
            number = self._ask(Request("GetContNo")).fields
            robots = self._ask(Request("GetRobotSerial", ("0",))).fields
        except RobolinkError:
            return ""
        return name_from([text.strip() for text in number], [text.strip() for text in robots])

    def leave(self, flags: StatusFlags) -> None:
        """Log out, where that does no harm: not while another device may begin a task.

        Logging out while a task runs is an error on the controller (docs/reference/epson.md 1.1).
        Whoever leaves without it just closes the connection, and nothing that fails here matters.
        """
        if flags.auto and not flags.paused:
            with suppress(RobolinkError):
                self._ask(Request("Logout"))

    def close(self) -> None:
        """Close the connection."""
        self._transport.close()

    def _ask(self, request: Request, *, secret: bool = False) -> Reply:
        self._line.require_carried(request.name)
        deadline = Deadline.after(self._transport.clock, self._timeout_s)
        self._transport.send(self._codec.send(request), deadline=deadline, secret=secret)
        for _ in range(_STRAYS):
            answer = self._next(deadline)
            if answer.name.lower() == request.name.lower() or not answer.name:
                return self._accepted(answer, request)
        raise RemoteProtocolError(
            tr(
                "{identity} sent an answer to a question nobody asked.",
                identity=self._transport.identity,
            ),
            remedy=tr("Look for a second program on this controller."),
            controller=self._transport.identity,
        )

    def _next(self, deadline: Deadline) -> Reply | Refusal:
        while True:
            event = self._codec.next_event()
            if isinstance(event, (Reply, Refusal)):
                return event
            if isinstance(event, EndOfStream):
                raise TransportBrokenError(
                    tr("{identity} closed the connection.", identity=self._transport.identity),
                    remedy=tr("Check cable and power of the controller, then try again."),
                    controller=self._transport.identity,
                )
            if event is NEED_DATA:
                self._codec.receive_data(self._transport.receive(deadline=deadline))

    def _accepted(self, answer: Reply | Refusal, request: Request) -> Reply:
        if isinstance(answer, Refusal):
            # Here, because a stop that is taken needs none of it.
            from robolink.controllers.epson.answers import rejected

            raise rejected(answer, controller=self._transport.identity, request=request.name)
        return answer
