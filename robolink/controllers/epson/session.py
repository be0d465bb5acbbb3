"""One login on an EPSON controller: a line and a lock.

Theory of operation. Remote Ethernet has no transaction numbers; an answer is known by its
name and by its place in line (docs/reference/epson.md 1.1). So at most two requests are
outstanding: one Execute, which answers when its statement has ended, and one of the few requests
that are legal meanwhile. Whoever holds the lock reads; an Execute answer that turns up is put into
the pending motion's slot. The lock is held for one exchange, never for a motion, so that a
stop always gets in.

A time-out, a broken link or an answer that nobody asked for ends the session for good: late
bytes die with the connection and can never be taken for the answer to a later question
(docs/reference/faults.md F01, F06, F09).

Requests as they stand on the wire: for a person to read, and for a stop to judge.

What a request does is judged from the text that leaves, not from who sends it: one that nobody
thought of counts as acting, and is held back while a stop is in force.

After the login on a serial line: the answers are those to the questions.

The line that opens does without this, because a stop does.
"""

import re
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import Final

from robolink import ambient
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controllers.epson.answers import rejected
from robolink.controllers.epson.line import PASSWORD_REFUSALS, EpsonLine, refused, unanswered
from robolink.errors import (
    BusyError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportBrokenError,
    TransportClosedError,
    TransportError,
    TransportTimeoutError,
)
from robolink.interrupts import InterruptGate
from robolink.messages import tr
from robolink.model import Secret
from robolink.protocols import NEED_DATA, Role
from robolink.protocols.epson_text import (
    EndOfStream,
    EpsonTextCodec,
    Refusal,
    Reply,
    Request,
    find_command,
)
from robolink.protocols.spel import Statement
from robolink.stop_latch import CommandClass, StopLatch
from robolink.timing import Deadline

_CALM: Final = frozenset({"stop", "abort", "pause", "resetalm", "setmotorsoff"})
_SESSION: Final = frozenset({"login", "logout"})

_LOOKS: Final = re.compile(r"(Print .*|Where|TLSet|Base|Here|RealPos)", re.ASCII)
_RESTORES: Final = re.compile(r"(Tool [0-9]+|Power (Low|High)|SpeedS? [0-9., ]+)", re.ASCII)
_WRITES: Final = re.compile(r"(TLSet [0-9]+, XY\([^()]*\)|TLClr [0-9]+)", re.ASCII)


def command_class_of(request: Request) -> CommandClass:
    """Return what ``request`` does.

    Statements are those of :mod:`robolink.protocols.spel`; one that a person typed, and several in
    one (``;``), count as acting unless they have exactly the form of one that does not.
    """
    name = request.name.lower()
    if name.startswith("get") or name in _SESSION:
        return CommandClass.LOOK
    if name == "reset":
        return CommandClass.RESET
    if name in _CALM:
        return CommandClass.CALM
    if name == "execute" and request.parameters:
        return _of_statement(request.parameters[0])
    return CommandClass.ACT


def _of_statement(statement: str) -> CommandClass:
    if ";" in statement:
        return CommandClass.ACT
    if _LOOKS.fullmatch(statement):
        return CommandClass.LOOK
    if _RESTORES.fullmatch(statement):
        return CommandClass.RESTORE
    if _WRITES.fullmatch(statement):
        return CommandClass.WRITE
    return CommandClass.ACT


def as_sent(request: Request) -> str:
    """Return the line of a request."""
    return EpsonTextCodec(Role.HOST).send(request).decode("ascii").rstrip()


def executes(statements: Iterable[Statement]) -> tuple[str, ...]:
    """Return the lines that run statements."""
    return tuple(as_sent(Request("Execute", (statement,))) for statement in statements)


@dataclass(slots=True)
class PendingExecute:
    """An Execute that was sent; ``answer`` is set by whoever reads it."""

    statement: Statement
    answer: Reply | Refusal | None = None
    abort_requested: bool = False


_SHOWN = 120
"""Characters of an unexpected answer in a sentence; a text may be thousands long."""


class EpsonSession:
    """Requests and answers on one connection.

    Attributes:
        identity: Which controller this is.
        place: Where it was reached, the same for each spelling of the URL.
        clock: The clock on which the controller's time passes.
        latch: What holds requests back while a stop is in force.

    Args:
        line: An open line; the session owns it from here on.
        timeout_s: Longest wait for the answer to one request that moves nothing.
    """

    def __init__(self, line: EpsonLine, *, timeout_s: float = 3.0) -> None:
        self._line = line
        self._transport = transport = line.transport
        self.identity, self.place, self.clock = transport.identity, transport.place, transport.clock
        self._codec = line.codec
        self._wire = ambient.lock()
        self._gate = InterruptGate()
        self._gate.open()
        self._pending: PendingExecute | None = None
        self._ended_by: RobolinkError | None = None
        self.latch = StopLatch(transport.identity)
        self.timeout_s = timeout_s
        self.exchanges = 0

    @property
    def alive(self) -> bool:
        """Whether the session can still be used."""
        return self._ended_by is None

    @property
    def pending(self) -> PendingExecute | None:
        """The Execute that has not been taken as finished, if any."""
        return self._pending

    @property
    def outlived(self) -> bool:
        """Whether bytes of an earlier session may still come: it is a serial line."""
        return self._line.outlives_sessions

    def carries(self, name: str) -> bool:
        """Whether a command of this name can be sent over this line."""
        return self._codec.carries(name)

    def login(self, password: Secret | None) -> None:
        """Log in. One attempt.

        Raises:
            LoginRefusedError: The password is wrong (13) or one is demanded (98).
            LoginUnansweredError: No answer; most likely another client is logged in.
        """
        request = Request("Login", (password.reveal() if password else "",))
        try:
            answer = self._ask(request, secret=True)
        except (TransportTimeoutError, TransportBrokenError) as error:
            raise unanswered(self.identity) from error
        if isinstance(answer, Refusal):
            self.close()
            if answer.code in PASSWORD_REFUSALS:
                raise refused(answer.code, self.identity)
            raise rejected(answer, controller=self.identity)

    def exchange(self, name: str, *parameters: str) -> Reply:
        """Send one request and return its answer.

        Raises:
            RejectedError: The controller refused; it did not act.
            BusyError: An Execute is running and this request is not legal meanwhile.
            TransportError, RemoteProtocolError: The session is over.
        """
        answer = self._ask(Request(name, parameters))
        if isinstance(answer, Refusal):
            raise rejected(answer, controller=self.identity)
        return answer

    def execute(self, statement: Statement) -> Reply | Refusal:
        """Run a statement that moves nothing and return whatever was answered."""
        return self._ask(Request("Execute", (statement,)))

    def start_execute(self, statement: Statement) -> PendingExecute:
        """Send a statement that takes its time; its answer is collected by name later."""
        request = Request("Execute", (statement,))
        with self._exchanging(request):
            pending = PendingExecute(statement)
            try:
                self._expect_silence()
                # What the codec refuses never leaves, and nothing would end the wait for it. From
                # here on some of it may leave, however the sending ends.
                data = self._codec.send(request)
                self._pending = pending
                self._transmit(data, secret=False)
            except RobolinkError as error:
                self._end(error)
                raise
        return pending

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Hold Ctrl-C back over exchanges that belong together; it is raised at their end."""
        return self._gate

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C is held back just now."""
        return self._gate.interrupted

    def finish(self, pending: PendingExecute) -> None:
        """Forget an Execute whose answer was taken."""
        if self._pending is pending:
            self._pending = None

    def await_pending(self, *, wait_s: float) -> None:
        """Wait up to ``wait_s`` for bytes, without the lock, then read what is there."""
        # The answer may have come in one piece with that of the last request.
        self._collect()
        if self._pending is None or self._pending.answer is None:
            self._transport.wait_readable(deadline=Deadline.after(self.clock, wait_s))
            self._collect()

    def close(self) -> None:
        """Close the connection. Idempotent."""
        if self._ended_by is None:
            self._ended_by = TransportClosedError(
                tr("The connection to {identity} is closed.", identity=self.identity),
                remedy=tr("Connect again."),
                controller=self.identity,
            )
        self._transport.close()
        self._gate.close()

    def _collect(self) -> None:
        with self._gate, self._wire:
            if self._ended_by is None:
                try:
                    self._expect_silence()
                except RobolinkError as error:
                    self._end(error)
                    raise

    @contextmanager
    def _exchanging(self, request: Request) -> Iterator[None]:
        """Hold the exchange lock for ``request``, once it is legal and no stop forbids it."""
        what = self._announced(request)
        try:
            with self._gate, self._wire:
                self._admit(request, what)
                yield
        finally:
            checkpoint(Checkpoint.EXCHANGE, what)

    def _ask(self, request: Request, *, secret: bool = False) -> Reply | Refusal:
        # As ``_exchanging``, but written out: a generator would cost each exchange a tenth of what
        # the driver takes for it, and a function about it would make its way longer.
        what = self._announced(request)
        try:
            with self._gate, self._wire:
                self._admit(request, what)
                try:
                    self._expect_silence()
                    deadline = self._transmit(self._codec.send(request), secret=secret)
                    return self._receive(request, deadline)
                except RobolinkError as error:
                    self._end(error)
                    raise
        finally:
            checkpoint(Checkpoint.EXCHANGE, what)

    def _announced(self, request: Request) -> str:
        """Return a request that this line can carry as a person may read it, before the lock."""
        what = _shown(request)
        if not self._codec.carries(request.name, *request.parameters):
            self._line.require_carried(request.name, *request.parameters)
        checkpoint(Checkpoint.LOCK, what)
        return what

    def _admit(self, request: Request, what: str) -> None:
        """Refuse, under the lock, what is not legal now or a stop forbids."""
        checkpoint(Checkpoint.HELD, what)
        self._check_usable(request)
        self.latch.admit(command_class_of(request), what)
        if self._pending is not None and request.name == "Abort":
            # Whatever ends it from here on was asked for.
            self._pending.abort_requested = True

    def _check_usable(self, request: Request) -> None:
        if self._ended_by is not None:
            raise TransportClosedError(
                tr("The connection to {identity} has ended.", identity=self.identity),
                remedy=tr("Connect again; the controller's state is then read again."),
                controller=self.identity,
                request=request.name,
            ) from self._ended_by
        if self._pending is not None and self._pending.answer is None:
            command = find_command(request.name)
            if command is None or not command.during_execute:
                raise BusyError(
                    tr(
                        "{name} has to wait: a statement is still running on the controller.",
                        name=request.name,
                    ),
                    remedy=tr("Wait until the movement has ended, or stop it."),
                    controller=self.identity,
                    request=request.name,
                )

    def _transmit(self, data: bytes, *, secret: bool) -> Deadline:
        deadline = Deadline.after(self.clock, self.timeout_s)
        self._transport.send(data, deadline=deadline, secret=secret)
        self.exchanges += 1
        return deadline

    def _receive(self, request: Request, deadline: Deadline) -> Reply | Refusal:
        wanted = request.name.lower()
        while True:
            # What had arrived before was judged before the request was sent.
            self._codec.receive_data(self._heard(request, deadline))
            while (event := self._codec.next_event()) is not NEED_DATA:
                if isinstance(event, (Reply, Refusal)) and self._answers(event, wanted):
                    return event
                # A login that was bent on its way comes back in its refusal, password and all.
                self._take_aside(event, hidden=wanted == "login")

    def _heard(self, request: Request, deadline: Deadline) -> bytes:
        try:
            return self._transport.receive(deadline=deadline)
        except TransportTimeoutError as error:
            if not (held := self._codec.bytes_held):
                raise
            # Half an answer is another trouble than none: the controller is there.
            raise TransportTimeoutError(
                tr(
                    "{identity} answered {count} bytes, then nothing: {request}.",
                    identity=self.identity,
                    count=len(held),
                    request=_shown(request),
                ),
                remedy=error.remedy,
                controller=self.identity,
                request=_shown(request),
                raw=held,
            ) from error

    def _answers(self, event: Reply | Refusal, wanted: str) -> bool:
        name = event.name.lower()
        if name == wanted:
            return True
        # A refusal may come without a readable name (docs/reference/epson.md 1.6, unverified); it
        # can be ours only when nothing else is outstanding.
        return isinstance(event, Refusal) and not name and self._pending is None

    def _expect_silence(self) -> None:
        """Read what has arrived unasked; only the pending Execute may answer by itself.

        Each piece is judged before the next is read. So a far end that never stops sending is
        noticed at its first whole message, or at the codec's limit for one, and not when
        memory is full.
        """
        self._judge_unasked()
        while (data := self._transport.receive_waiting()) is not None:
            self._codec.receive_data(data)
            self._judge_unasked()

    def _judge_unasked(self) -> None:
        while (event := self._codec.next_event()) is not NEED_DATA:
            self._take_aside(event)

    def _take_aside(self, event: object, *, hidden: bool = False) -> None:
        if isinstance(event, EndOfStream):
            raise TransportBrokenError(
                tr("{identity} closed the connection.", identity=self.identity),
                remedy=tr(
                    "Check cable, power and remote time-out of the controller, then try again."
                ),
                controller=self.identity,
            )
        pending = self._pending
        if (
            isinstance(event, (Reply, Refusal))
            and event.name.lower() == "execute"
            and pending is not None
            and pending.answer is None
        ):
            pending.answer = event
            return
        raise RemoteProtocolError(
            tr(
                "The controller sent an answer to a question nobody asked: {event}.",
                event="***" if hidden else repr(event)[:_SHOWN],
            ),
            remedy=tr(
                "The connection is closed, because later answers could be mistaken. Connect "
                "again; if it happens twice, look for a second program on this controller."
            ),
            controller=self.identity,
        )

    def _end(self, error: RobolinkError) -> None:
        if isinstance(error, (TransportError, RemoteProtocolError)):
            if not error.controller:
                error.controller = self.identity
            if self._ended_by is None:
                self._ended_by = error
            self._transport.close()


def _shown(request: Request) -> str:
    """Return a request as a person may read it. Never the parameters of a login."""
    return request.parameters[0] if request.name == "Execute" else request.name


def prove_in_step(session: EpsonSession) -> None:
    """See that an answer belongs to its question, on a line that outlives its sessions.

    No other request is answered with the letter of GetCurRobot, and nothing else asks for it so
    early; so an answer to it can be no late one. It holds a number too, which shows that both
    ends write numbers alike.

    Raises:
        RemoteProtocolError: The answers are not those to the questions, or numbers are written
            in another way.
        TransportError: Nothing comes.
    """
    try:
        session.exchange("GetCurRobot")
    except RejectedError:
        return  # a refusal is an answer to it, too
    except (RemoteProtocolError, TransportTimeoutError) as error:
        error.remedy = tr(
            "Connect again. If it happens twice, the controller writes numbers in another "
            "way: say numbers=ascii_hex in the URL (docs/remote-rs232.md)."
        )
        raise
