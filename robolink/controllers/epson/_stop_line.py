"""A login that does nothing but stop.

It is not a session: there is no record beside it, nothing of its own can be pending, and what
turns up unasked, such as the late answer to the Execute that it ends, is passed over. Nothing is
imported that its first frame does not need.
"""

from contextlib import suppress

from robolink.controllers.epson._login import PASSWORD_REFUSALS, refused, unanswered
from robolink.controllers.epson._stopping import bring_to_rest
from robolink.errors import (
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportTimeoutError,
)
from robolink.messages import tr
from robolink.protocols.epson_text import (
    NEED_DATA,
    EndOfStream,
    EpsonTextCodec,
    Refusal,
    Reply,
    Request,
    Role,
    StatusFlags,
)
from robolink.timing import Deadline
from robolink.transport import Transport

_STRAYS = 16
"""More answers than this to questions that nobody asked are no controller's."""


class StopLine:
    """One connection, from the login to the controller's rest.

    Args:
        transport: An open transport; it is owned from here on.
        timeout_s: Longest wait for one answer.
    """

    def __init__(self, transport: Transport, *, timeout_s: float) -> None:
        self._transport = transport
        self._timeout_s = timeout_s
        self._codec = EpsonTextCodec(Role.HOST)

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
        deadline = Deadline.after(self._transport.clock, self._timeout_s)
        self._transport.send(self._codec.send(request), deadline=deadline, secret=secret)
        for _ in range(_STRAYS):
            answer = self._next(deadline)
            if answer.name.lower() == request.name.lower() or not answer.name:
                return self._accepted(answer, request)
        raise RemoteProtocolError(
            tr("{identity} answers what nobody asked.", identity=self._transport.identity),
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
                    remedy=tr("Check the controller's power and the cable, then connect again."),
                    controller=self._transport.identity,
                )
            if event is NEED_DATA:
                self._codec.receive_data(self._transport.receive(deadline=deadline))

    def _accepted(self, answer: Reply | Refusal, request: Request) -> Reply:
        if isinstance(answer, Refusal):
            # Here, because a stop that is taken needs none of it.
            from robolink.controllers.epson._answers import rejected

            raise rejected(answer, controller=self._transport.identity, request=request.name)
        return answer
