"""The line to a controller, and its one conversation.

Over TCP, and in process, that is Remote Ethernet; on a serial line Remote RS232, whose frames are
loaded only there, since a stop is timed (docs/decisions/0017). For the same reason a refusal is
put into words by a module that is loaded when one comes.

A stop holds the conversation as it stands here: it has no record beside it, nothing of its own can
be pending, and what turns up unasked, such as the late answer to the Execute that it ends, is
passed over. A session (:mod:`robolink.controllers.epson.session`) takes nothing unasked but the
answer to its own Execute, and adds the lock and the latch.

An answer that was given up ends either of them for good: late bytes die with the connection and can
never be taken for the answer to a later question (docs/reference/faults.md F01, F06, F09). Nothing
more is sent then, not even a Logout: the state in which that does no harm was read before the
silence.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink.errors import (
    LoginRefusedError,
    LoginUnansweredError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportClosedError,
    TransportError,
    TransportTimeoutError,
)
from robolink.messages import listed, tr
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_text import (
    EndOfStream,
    EpsonCodec,
    EpsonTextCodec,
    ErrorCode,
    Refusal,
    Reply,
    Request,
)
from robolink.remedy_words import RemedyWord, remedy_word
from robolink.timing import Clock, Deadline
from robolink.transport import LinkUrl, TraceSink, Transport, open_transport, told_to
from robolink.transport.byte_stream import link_closed, logged
from robolink.transport.traffic import repeats

if TYPE_CHECKING:
    from robolink.protocols.epson_binary import Dialect


SERIAL: Final = "serial"
"""Medium of Remote RS232."""


_LOGIN_ANSWERS: Final = frozenset(
    text.encode("ascii") + end
    for text in ("#Login,0", *(f"!Login,{int(code)}" for code in ErrorCode))
    for end in (b"\r\n", b"\r", b"\n")
)
"""Answers to a login that cannot contain a password (docs/reference/epson.md 1.6)."""


@dataclass(frozen=True, slots=True)
class EpsonLine:
    """An open line.

    Attributes:
        transport: Moves the bytes.
        codec: Frames them.
        outlives_sessions: Whether bytes of an earlier session may still come.
    """

    transport: Transport
    codec: EpsonCodec
    outlives_sessions: bool = False

    def require_carried(self, name: str, *parameters: str) -> None:
        """Refuse a request that this line has no frame for, as older firmware would.

        Raises:
            RejectedError: With code 11, unknown command. Nothing was sent.
        """
        if self.codec.carries(name, *parameters):
            return
        if self.codec.carries(name):
            what = tr("{name} cannot read several values over Remote RS232.", name=name)
        else:
            what = tr("Remote RS232 has no {name}, or no manual prints its letter.", name=name)
        raise RejectedError(
            what,
            code=ErrorCode.UNKNOWN_COMMAND,
            remedy=tr("Nothing was sent. Use Remote Ethernet for it (docs/remote-rs232.md)."),
            controller=self.transport.identity,
            request=name,
        )


def text_line(transport: Transport) -> EpsonLine:
    """Return a line of Remote Ethernet over any transport."""
    told = logged(transport)
    told.show_answers(_LOGIN_ANSWERS)
    return EpsonLine(told, EpsonTextCodec(Role.HOST))


def open_line(
    url: str | LinkUrl,
    *,
    timeout_s: float,
    clock: Clock | None = None,
    traces: tuple[TraceSink, ...] = (),
) -> EpsonLine:
    """Open the line that a URL names; a serial one is silenced and turned on.

    Args:
        url: The controller. On a serial line it may say what the manuals leave open; see
            :class:`robolink.protocols.epson_binary.Dialect`.
        timeout_s: Longest wait for the connection.
        clock: Replaces the machine's clock.
        traces: Each is told of all traffic but the login.

    Raises:
        ConfigError: The URL or an option is wrong.
        ConnectError: No connection could be made.
        RemoteProtocolError: The serial line does not fall silent.
    """
    from robolink.transport import parse_url

    link = parse_url(url) if isinstance(url, str) else url
    dialect = None
    if link.medium == SERIAL:
        from robolink.controllers.epson.serial_opening import take_dialect

        dialect, link = take_dialect(link)
    with told_to(*traces):
        transport = open_transport(link, timeout_s=timeout_s, clock=clock)
    if dialect is None:
        return text_line(transport)
    return _turned_on(transport, dialect)


def _turned_on(transport: Transport, dialect: "Dialect") -> EpsonLine:
    from robolink.controllers.epson.serial_opening import turn_on
    from robolink.protocols.epson_binary import EpsonBinaryCodec

    try:
        turn_on(transport)
    except BaseException:
        transport.close()
        raise
    told, far = logged(transport), EpsonBinaryCodec(Role.DEVICE, dialect)
    told.show_answers(
        [
            far.send(Reply("Login", ("0",))),
            *(far.send(Refusal("Login", int(code))) for code in ErrorCode),
        ]
    )
    return EpsonLine(told, EpsonBinaryCodec(Role.HOST, dialect), outlives_sessions=True)


_PASSWORD_REFUSALS: Final = (13, 98)
"""The password is wrong, or one is required (docs/reference/epson.md 1.6)."""

_STRAYS: Final = 16
"""Largest number of unrequested answers; a controller never sends so many."""


class EpsonConversation:
    """Requests and answers on one line, one by one, until one of them is in doubt.

    Attributes:
        identity: Which controller this is.
        clock: The clock on which the controller's time passes.
        timeout_s: Longest wait for the answer to one request that moves nothing.

    Args:
        line: An open line; it is owned from here on.
        timeout_s: See above.
    """

    def __init__(self, line: EpsonLine, *, timeout_s: float) -> None:
        self._line = line
        self._codec = line.codec
        self._transport = line.transport
        self.identity, self.clock = line.transport.identity, line.transport.clock
        self.timeout_s = timeout_s
        self._passed_over = 0
        self._ended_by: RobolinkError | None = None

    @property
    def alive(self) -> bool:
        """Whether it is still usable."""
        return self._ended_by is None

    def login(self, password: str) -> None:
        """Log in, with an empty password where none is set. One attempt.

        Raises:
            LoginRefusedError: The password is wrong (13) or one is demanded (98).
            LoginUnansweredError: No answer; most likely another client is logged in.
        """
        try:
            answer = self.ask(Request("Login", (password,)), secret=True)
        except (TransportTimeoutError, TransportBrokenError) as error:
            raise _unanswered(self.identity) from error
        if isinstance(answer, Refusal):
            self.close()
            if answer.code in _PASSWORD_REFUSALS:
                raise _refused(answer.code)
            raise self._rejected(answer, "Login")

    def exchange(self, name: str, *parameters: str) -> Reply:
        """Send one request and return its answer.

        Raises:
            RejectedError: The controller refused; it did not act.
            BusyError: An Execute is running and this request is not legal meanwhile.
            TransportError, RemoteProtocolError: The conversation is over.
        """
        answer = self.ask(Request(name, parameters))
        if isinstance(answer, Refusal):
            raise self._rejected(answer, name)
        return answer

    def ask(self, request: Request, *, secret: bool = False) -> Reply | Refusal:
        """Send one request and return whatever was answered.

        Args:
            request: It moves nothing, so that its answer comes within the time-out.
            secret: Whether the traces may not see it.

        Raises:
            TransportClosedError: The conversation is over; nothing was sent.
            TransportError, RemoteProtocolError: It is over from here on.
        """
        self._line.require_carried(request.name, *request.parameters)
        self._require_alive(request)
        self._passed_over = 0
        try:
            data = self._codec.send(request)
            deadline = Deadline.after(self.clock, self.timeout_s)
            self._transport.send(data, deadline=deadline, secret=secret)
            return self._receive(request, deadline, secret=secret)
        except RobolinkError as error:
            self._end(error)
            raise

    def close(self) -> None:
        """Close the connection. Idempotent."""
        self._ended_by = self._ended_by or link_closed(self.identity)
        self._transport.close()

    def _require_alive(self, request: Request) -> None:
        if self._ended_by is not None:
            raise TransportClosedError(
                tr("The connection to {identity} has ended.", identity=self.identity),
                remedy=tr("Connect again; the controller's state is then read again."),
                controller=self.identity,
                request=request.name,
            ) from self._ended_by

    def _end(self, error: RobolinkError) -> None:
        if isinstance(error, (TransportError, RemoteProtocolError)):
            if not error.controller:
                error.controller = self.identity
            if self._ended_by is None:
                self._ended_by = error
            self._transport.close()

    def _receive(
        self, request: Request, deadline: Deadline, *, secret: bool = False
    ) -> Reply | Refusal:
        """Read until the answer to a request that was sent has come.

        Raises:
            RemoteProtocolError: It repeats the password of a login, which then is in no error.
        """
        wanted, came = request.name.lower(), b""
        while True:
            try:
                data = self._transport.receive(deadline=deadline)
            except TransportTimeoutError as error:
                self._require_none_held(request, error)
                raise
            if secret:
                came += data
                if any(repeats(parameter, came) for parameter in request.parameters):
                    raise self._echoed()
            self._codec.receive_data(data)
            while (event := self._codec.next_event()) is not NEED_DATA:
                if isinstance(event, (Reply, Refusal)) and self._answers(event, wanted):
                    return event
                # A login garbled on the line comes back in its refusal, including the password.
                self._take_aside(event, hidden=wanted == "login")

    def _require_none_held(self, request: Request, error: TransportTimeoutError) -> None:
        """Say where a time-out cut an answer: the controller is there, unlike without any."""
        if held := self._codec.bytes_held:
            raise TransportTimeoutError(
                listed(
                    tr(
                        "{identity} sent only {count} bytes of its answer.",
                        identity=self.identity,
                        count=len(held),
                    ),
                    [as_shown(request)],
                ),
                remedy=error.remedy,
                request=as_shown(request),
                raw=held,
            ) from error

    def _answers(self, event: Reply | Refusal, wanted: str) -> bool:
        """Whether it answers the request of that name, in small letters.

        A refusal may come without a readable name (docs/reference/epson.md 1.6, unverified).
        """
        name = event.name.lower()
        return name == wanted or (isinstance(event, Refusal) and not name)

    def _take_aside(self, event: object, *, hidden: bool = False) -> None:  # noqa: ARG002 - not shown
        """Skip what does not answer the pending request.

        Args:
            event: What it is.
            hidden: Whether it may hold a password.
        """
        if isinstance(event, EndOfStream):
            raise self._closed_by_far_end()
        self._passed_over += 1
        if self._passed_over >= _STRAYS:
            raise RemoteProtocolError(
                tr(
                    "{identity} sent an answer that robolink did not ask for.",
                    identity=self.identity,
                ),
                remedy=tr("Check for a second program on this controller."),
            )

    def _rejected(self, refusal: Refusal, name: str) -> RejectedError:
        from robolink.controllers.epson.answers import rejected

        return rejected(refusal, controller=self.identity, request=name)

    def _echoed(self) -> RemoteProtocolError:
        return RemoteProtocolError(
            tr("{identity} answered the login with the password.", identity=self.identity),
            remedy=tr(
                "Check that this port is the controller's Remote Ethernet port; if it is, check "
                "the cable."
            ),
            controller=self.identity,
            request="Login",
        )

    def _closed_by_far_end(self) -> TransportBrokenError:
        return TransportBrokenError(
            tr("{identity} closed the connection.", identity=self.identity),
            remedy=tr("Check cable, power and remote time-out of the controller, then try again."),
        )


def as_shown(request: Request) -> str:
    """Return a request for display, without the parameters of a login."""
    return request.parameters[0] if request.name == "Execute" else request.name


def _unanswered(controller: str) -> LoginUnansweredError:
    return LoginUnansweredError(
        tr("{identity} does not answer the login.", identity=controller),
        remedy=tr(
            "Only one client may be logged in: close the other, or wait for it ({wait}). If "
            "there is none: check the port of Remote Ethernet.",
            wait=remedy_word(RemedyWord.WAIT),
        ),
        request="Login",
    )


def _refused(code: int) -> LoginRefusedError:
    return LoginRefusedError(
        tr("The controller refused the login (code {code}).", code=code),
        code=code,
        remedy=tr(
            "robolink did not try again. Give the password of the controller's Remote Ethernet "
            "page: {password}.",
            password=remedy_word(RemedyWord.PASSWORD),
        ),
        request="Login",
    )
