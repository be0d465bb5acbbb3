"""Connections of clients to the simulated controller: codec, login, replies and their times.

Who is logged in, and for how long silence is tolerated (docs/reference/epson.md 1.1).

On a serial line nothing is connected: EOT begins, and silence ends a request that was cut short.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_binary import Dialect, EpsonBinaryCodec
from robolink.protocols.epson_text import (
    BadRequest,
    EpsonTextCodec,
    ErrorCode,
    Opening,
    Refusal,
    Reply,
    Request,
)
from robolink.timing import NS_PER_S
from robolink_simulators.device.wire_time import WireTime
from robolink_simulators.epson.options import EpsonOptions
from robolink_simulators.faults import Departure, Fault, FaultAction
from robolink_simulators.faults.departing import DepartingReplies


def shown_request(event: Request | BadRequest) -> str:
    """Return a request in one line."""
    name = event.name
    if isinstance(event, BadRequest):
        return "***" if "login" in name.lower() else name
    match name.lower():
        case "login":
            return f"${name},***"
        case "execute":
            return f'${name},"{event.parameters[0]}"'  # inner quotes stay as received
        case _:
            return ",".join((f"${name}", *event.parameters))


def shown_reply(reply: bytes) -> str:
    """Return a reply without its terminator."""
    text = reply.decode("latin-1").rstrip("\r\n")
    if text[:1] != "!":
        return text
    # The refusal of an unreadable login repeats the login, including the password.
    mistyped = "login" in text.lower() and text[1:6].lower() + text[6:7] != "login,"
    return "***" if mistyped else text


class ClientSlot:
    """The one place for a logged-in client, watched by the remote time-out.

    When a client vanishes without a logout while something runs, its silence goes on being
    counted: that a finite time-out also ends what runs is inferred (docs/reference/epson.md 1.7).

    Args:
        remote_timeout_s: Longest silence; 0 for any.
        wire_time: By which it is counted.
    """

    __slots__ = (
        "_heard_ns",
        "_timeout_ns",
        "_wire_time",
        "client",
    )

    def __init__(self, remote_timeout_s: float, wire_time: WireTime) -> None:
        self._timeout_ns = round(remote_timeout_s * NS_PER_S)
        self._wire_time = wire_time
        self._heard_ns: int | None = None
        self.client: EpsonServerLink | None = None

    def admit(self, client: "EpsonServerLink", now_ns: int) -> None:
        """Log a client in."""
        self.client = client
        self.heard(now_ns)

    def hears(self, link: "EpsonServerLink", *, cuts: bool) -> bool:
        """Return whether a connection is served; a second client may be cut off."""
        if self.client in (None, link):
            return True
        if cuts:
            link.cut()
        return False

    def heard(self, now_ns: int) -> None:
        """Note a request of the client."""
        self._heard_ns = self._wire_time.at(now_ns)

    def free(self) -> None:
        """Note the client's logout."""
        self.client = self._heard_ns = None

    def lost(self, *, unfinished: bool) -> None:
        """Note that the client is gone; keep measuring its silence while a job is unfinished."""
        self.client = None
        self.settle(unfinished=unfinished)

    def settle(self, *, unfinished: bool) -> None:
        """Drop the silence of a client that is gone once nothing of it is unfinished."""
        if self.client is None and not unfinished:
            self._heard_ns = None

    def deadline(self, *, unfinished: bool) -> int | None:
        """Return when the silence will be too long, if it is measured."""
        counted = self.client is not None or unfinished
        if self._heard_ns is None or not self._timeout_ns or not counted:
            return None
        return self._wire_time.simulated_at(self._heard_ns + self._timeout_ns)

    def overdue(self, now_ns: int, *, unfinished: bool) -> "tuple[bool, EpsonServerLink | None]":
        """Return whether the silence is too long, and whose it was; the place is free."""
        self.settle(unfinished=unfinished)
        deadline = self.deadline(unfinished=unfinished)
        if deadline is None or now_ns < deadline:
            return False, None
        client = self.client
        self.free()
        return True, client


@dataclass(slots=True)  # not frozen: each request makes one, in a third of the time
class PendingRequest:
    """A request that was received.

    Attributes:
        number: Running number over all clients, from 1.
        name: The command in the case in which the client wrote it; the answer echoes it.
        faults: What is planned to go wrong with it.
        link: Where the answer goes.
    """

    number: int
    name: str
    faults: tuple[Fault, ...]
    link: "EpsonServerLink"

    def reply(self, *fields: str) -> None:
        """Answer with fields, ``0`` when there are none."""
        self.link.answer(self, Reply(self.name, fields or ("0",)))

    def reply_text(self, text: str) -> None:
        """Answer with what a statement printed."""
        self.link.answer(self, Reply(self.name, text=text))

    def refuse(self, code: int) -> None:
        """Answer with an error code."""
        self.link.answer(self, Refusal(self.name, int(code)))

    def meets(self, action: FaultAction) -> bool:
        """Return whether a fault of this kind is planned for it."""
        return bool(self.faults) and any(fault.action is action for fault in self.faults)


_SILENCE_NS: Final = 100_000_000
"""Silence in ns after which a request without a line end counts as complete (inferred)."""

_ACK: Final = b"\x06"

_TERMINATORS: Final = {"crlf": b"\r\n", "cr": b"\r", "lf": b"\n"}


class RequestHandler(Protocol):
    """The controller, as its connections see it."""

    options: EpsonOptions
    wire_time: WireTime
    answer_s: float

    @property
    def now_ns(self) -> int:
        """The simulated time."""

    def advance(self, now_ns: int) -> None:
        """Let simulated time reach ``now_ns``."""

    def take(self, link: "EpsonServerLink", event: Request | BadRequest) -> None:
        """Handle a request."""

    def take_late(self, link: "EpsonServerLink", event: Request | BadRequest) -> None:
        """Handle a request that was counted already: it meets no fault again."""

    def leaving(self, exchange: PendingRequest, reply: bytes) -> Sequence[Departure]:
        """Count a reply and return which parts of it are sent, and when."""

    def listening(self) -> None:
        """Note that a request has begun which silence may end."""

    def announce(self, exchange: PendingRequest, reply: bytes) -> None:
        """Tell observers that a reply is about to be sent."""

    def forget(self, link: "EpsonServerLink") -> None:
        """Note that the connection is over."""


class EpsonServerLink:
    """Implements :class:`~robolink_simulators.hosting.addresses.DeviceLink`.

    A client that has not logged in within the login time-out is cut off, and so is one that
    stays after its logout (assumed).

    Attributes:
        dialect: How frames are written; ``None`` for Remote Ethernet.
        over: Whether the controller knows of no connection here any more.
    """

    __slots__ = (
        "_anonymous_since_ns",
        "_codec",
        "_controller",
        "_hung_up",
        "_late",
        "_outbox",
        "_serial",
        "_silent_since_ns",
        "_turned_on",
        "_wire_time",
        "dialect",
        "over",
    )

    def __init__(
        self, controller: RequestHandler, now_ns: int, *, dialect: Dialect | None = None
    ) -> None:
        options = controller.options
        self._controller = controller
        self._codec: EpsonTextCodec | EpsonBinaryCodec = (
            EpsonTextCodec(
                Role.DEVICE,
                terminator=_TERMINATORS[options.terminator],
                unterminated=options.requests_end_with_silence,
                skips_blanks=options.blank_before_dollar == "skipped",
            )
            if dialect is None
            else EpsonBinaryCodec(Role.DEVICE, dialect)
        )
        self.dialect = dialect
        self._serial = dialect is not None
        self._turned_on = not self._serial
        self._outbox = DepartingReplies()
        self._late: list[Request | BadRequest] = []
        self._hung_up = False
        self.over = False
        self._wire_time = controller.wire_time
        self._anonymous_since_ns: int | None = self._wire_time.at(now_ns)
        self._silent_since_ns: int | None = None

    @property
    def closed(self) -> bool:
        """Whether the controller has ended this connection, after what is outgoing."""
        return not self._outbox.idle and self._outbox.ended(self._controller.now_ns)

    @property
    def reset(self) -> bool:
        """Whether it has ended it with a reset."""
        return self._outbox.reset(self._controller.now_ns)

    def receive(self, data: bytes, now_ns: int) -> None:
        """Take bytes from the client; ``b""`` means that it is gone."""
        self._controller.advance(now_ns)
        if self.over or self._outbox.half_open:
            return
        if not data:
            self._hung_up = True
            self._leave()
            return
        try:
            self._codec.receive_data(data)
            for request in self._requests():
                self._controller.take(self, request)
        except RemoteProtocolError:
            self.cut()
            return
        self._note_silence()

    @property
    def drained(self) -> bool:
        """Whether nothing will happen on this connection any more."""
        return self.over and self._outbox.empty(self._controller.now_ns)

    def outgoing(self) -> bytes:
        """Take what is ready for the client, ``b""`` for nothing."""
        return self._outbox.take(self._controller.now_ns)

    def next_change(self) -> int | None:
        """Return when something leaves, or when the login time-out passes."""
        if not self._outbox.idle:
            leaving = self._outbox.next_change(self._controller.now_ns)
            if leaving is not None:
                return leaving
        if self._anonymous_since_ns is None and self._silent_since_ns is None:
            return None
        login_ns, silent_ns = self._login_deadline(), self._silence_ends_ns()
        if login_ns is None or silent_ns is None:
            return silent_ns if login_ns is None else login_ns
        return min(login_ns, silent_ns)

    def supervise(self, now_ns: int) -> None:
        """End a request after which nothing came; disconnect a client without a login in time."""
        if self._late and not self._stalled:
            self._catch_up()
        silent_ns = self._silence_ends_ns()
        if silent_ns is not None and now_ns >= silent_ns:
            self._silent_since_ns = None
            self._end_request()
        deadline = self._login_deadline()
        if deadline is not None and now_ns >= deadline:
            self.cut()

    def logged_in(self, logged_in: bool, now_ns: int) -> None:
        """Start or end the wait for a login."""
        self._anonymous_since_ns = None if logged_in else self._wire_time.at(now_ns)

    def answer(self, exchange: PendingRequest, event: Reply | Refusal) -> None:
        """Send an answer, as its planned faults allow."""
        if self.over:
            return
        try:
            reply = self._codec.send(event)
        except LocalProtocolError:
            # Longer than 4060 bytes, or impossible to frame: a controller's answer to this is
            # not documented.
            reply = self._codec.send(Refusal(exchange.name, ErrorCode.SYSTEM))
        departures = self._controller.leaving(exchange, reply)
        try:
            self._controller.announce(exchange, reply)
        finally:
            self._depart(departures)

    def push(self, data: bytes) -> None:
        """Send bytes without a request."""
        self._outbox.post(data, self._controller.now_ns)

    def cut(self) -> None:
        """End the connection from the controller's side, after what is in transit."""
        if not self.over:
            self._outbox.post(None, self._controller.now_ns)
            self._end()

    def stall(self, event: Request | BadRequest, seconds: float) -> None:
        """Carry nothing for a while; then a request arrives, and what was sent after it."""
        self._outbox.stalled_until_ns = self._controller.now_ns + max(1, round(seconds * NS_PER_S))
        self._late.append(event)

    @property
    def _stalled(self) -> bool:
        return self._controller.now_ns < self._outbox.stalled_until_ns

    def _catch_up(self) -> None:
        late, self._late = self._late, []
        for event in late:
            if not self.over:
                self._controller.take_late(self, event)
        try:
            for request in self._requests():
                self._controller.take(self, request)
        except RemoteProtocolError:
            self.cut()
        self._leave()

    def _leave(self) -> None:
        """Let the controller notice, once it can, that the client is gone."""
        if self._hung_up and not self.over and not self._stalled:
            self._end()

    def _depart(self, departures: Sequence[Departure]) -> None:
        if not self._outbox.depart(departures, self._controller.now_ns):
            self._end()

    def _note_silence(self) -> None:
        """Measure from now the silence after the beginning of a request."""
        if not (self._serial or self._controller.options.requests_end_with_silence):
            return
        begun = self._codec.bytes_held
        if begun or self._silent_since_ns is not None:
            self._silent_since_ns = self._wire_time.at(self._controller.now_ns) if begun else None
            self._controller.listening()

    def _end_request(self) -> None:
        broken = self._codec.end_of_request()
        if isinstance(broken, (Request, BadRequest)) and self._turned_on:
            self._controller.take(self, broken)
        for request in self._requests():
            self._controller.take(self, request)

    def _requests(self) -> Iterator[Request | BadRequest]:
        """Yield the complete requests, while this connection carries anything."""
        while not (self.over or self._stalled or self._outbox.half_open):
            if (event := self._codec.next_event()) is NEED_DATA:
                return
            if isinstance(event, Opening):
                self._turned_on = True
                if self._controller.options.rs232_eot_answer == "ack":
                    self._depart(((self._controller.answer_s, _ACK),))
            elif isinstance(event, (Request, BadRequest)) and self._turned_on:
                yield event

    def _end(self) -> None:
        self.over = True
        self._anonymous_since_ns = self._silent_since_ns = None
        self._controller.forget(self)

    def _login_deadline(self) -> int | None:
        timeout_s = self._controller.options.login_timeout_s
        if self._anonymous_since_ns is None or timeout_s == 0:
            return None
        over_ns = self._anonymous_since_ns + round(timeout_s * NS_PER_S)
        return self._wire_time.simulated_at(over_ns)

    def _silence_ends_ns(self) -> int | None:
        """Return when a request that was begun counts as complete."""
        if self._silent_since_ns is None:
            return None
        return self._wire_time.simulated_at(self._silent_since_ns + _SILENCE_NS)


class OpenLinks:
    """Stores connections until nothing will happen on them any more."""

    __slots__ = ("_links",)

    def __init__(self) -> None:
        self._links: list[EpsonServerLink] = []

    @property
    def settled(self) -> bool:
        """Whether none has ended with data still in transit."""
        for link in self._links:  # noqa: SIM110 - asked in every exchange: a generator costs more
            if link.over:
                return False
        return True

    def add(self, link: EpsonServerLink) -> None:
        """Add one."""
        self._links.append(link)

    def next_change(self) -> int | None:
        """Return when something happens on one of them by itself, if ever."""
        first = None
        for link in self._links:
            change = link.next_change()
            if change is not None and (first is None or change < first):
                first = change
        return first

    def supervise(self, now_ns: int) -> None:
        """Apply their time-outs, and forget those that have ended."""
        for link in self._links:
            link.supervise(now_ns)
        self._links = [link for link in self._links if not link.drained]

    def cut(self) -> None:
        """End all of them from the controller's side."""
        for link in self._links:
            link.cut()

    def push(self, data: bytes) -> None:
        """Send every client bytes without a request (F10)."""
        for link in self._links:
            link.push(data)
