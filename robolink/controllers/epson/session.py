"""One login on an EPSON controller: the conversation on its line, a lock, and a latch.

Theory of operation. Remote Ethernet has no transaction numbers; an answer is known by its
name and by its place in line (docs/reference/epson.md 1.1). So at most two requests are
outstanding: one Execute, which answers when its statement has ended, and one of the few requests
that are legal meanwhile. Whoever holds the lock reads; an Execute answer that turns up is put into
the pending motion's slot. The lock is held for one exchange, never for a motion, so that a
stop always gets in.

Like every conversation it ends for good with a time-out or a broken link; a session ends with an
answer that nobody asked for, too.

What a request does is judged from the text that leaves, not from who sends it: one that nobody
thought of counts as acting, and is held back while a stop is active.

Who else has the only login is asked of the record: the controller does not tell.
"""

import re
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from robolink import runtime
from robolink.checkpoints import Checkpoint, checkpoint
from robolink.controllers.epson.line import SERIAL, EpsonConversation, EpsonLine, as_shown
from robolink.errors import (
    BusyError,
    Concerning,
    ConnectError,
    JournalError,
    LoginUnansweredError,
    RejectedError,
    RemoteProtocolError,
    RobolinkError,
    TransportTimeoutError,
)
from robolink.interrupts import InterruptGate
from robolink.messages import tr
from robolink.model import Controller, OutcomeLog, Secret
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
from robolink.timing import AnswerTimes, Deadline
from robolink.transport import LinkUrl

if TYPE_CHECKING:  # a stop does without the journal, which comes with it
    from robolink.controllers.registry import ConnectionTerms

_CALM: Final = frozenset({"stop", "abort", "pause", "resetalm", "setmotorsoff"})
_SESSION: Final = frozenset({"login", "logout"})
_SETS_BACK: Final = frozenset({"abort", "reset", "setmotorson"})
"""Requests that put power, speed and acceleration back, or may (docs/reference/spel.md 6.3)."""

_SHOWN_BY_PRINT: Final = (
    r"Accel|AccelS|Agl|Chr\$|CX|CY|CZ|CU|CV|CW|FindPos|Here|LJM|Motor|Oport|PAgl|PDef|PosFound|Power"
    r"|RealPos|Robot|RobotModel\$|RobotSerial\$|RobotType|Speed|SpeedFactor|SpeedS|Sw|TargetOK"
    r"|TillOn|TLDef|TLSet|Tool|XY"
)
"""What Print may name: functions of SPEL+ that only read. A program's own function may move, and
Print with a # writes to a port or a file."""

_LOOKS: Final = re.compile(
    r"Print (?:\"[^\"]*+\"|[ (),.+0-9-]|/[A-Z0-9]++|P[0-9]++|(?:"
    + _SHOWN_BY_PRINT
    + r")(?![\w$]))*+|Where|TLSet|Base|Here|RealPos",
    re.ASCII,
)
_RESTORES: Final = re.compile(
    r"(Tool [0-9]+|Power (Low|High)|(SpeedS?|AccelS) [0-9., ]+)", re.ASCII
)
_WRITES: Final = re.compile(r"(TLSet [0-9]+, XY\([^()]*\)|TLClr [0-9]+)", re.ASCII)

# Each request asks for them, and before Python 3.12 a member of an Enum is found slowly.
_LOCK, _HELD, _EXCHANGE = Checkpoint.LOCK, Checkpoint.HELD, Checkpoint.EXCHANGE
_LOOK, _ACT = CommandClass.LOOK, CommandClass.ACT


def command_class_of(request: Request) -> CommandClass:
    """Return what ``request`` does.

    Statements are those of :mod:`robolink.protocols.spel`; one that a person typed, and several in
    one (``;``), count as acting unless they have exactly the form of one that does not.
    """
    name = request.name.lower()
    if name.startswith("get") or name in _SESSION:
        return _LOOK
    if name == "reset":
        return CommandClass.RESET
    if name in _CALM:
        return CommandClass.CALM
    if name == "execute" and request.parameters:
        return _of_statement(request.parameters[0])
    return _ACT


def _of_statement(statement: str) -> CommandClass:
    if ";" in statement:
        return _ACT
    if _LOOKS.fullmatch(statement):
        return _LOOK
    if _RESTORES.fullmatch(statement):
        return CommandClass.RESTORE
    if _WRITES.fullmatch(statement):
        return CommandClass.WRITE
    return _ACT


def as_sent(request: Request) -> str:
    """Return the line of a request."""
    return EpsonTextCodec(Role.HOST).send(request).decode("ascii").rstrip()


def execution(statement: Statement) -> Request:
    """Return the request that runs a statement."""
    return Request("Execute", (statement,))


def executes(statements: Iterable[Statement]) -> tuple[str, ...]:
    """Return the lines that run statements."""
    return tuple(as_sent(execution(statement)) for statement in statements)


@dataclass(slots=True)
class PendingExecute:
    """An Execute that was sent; ``answer`` is set by whoever reads it."""

    statement: Statement
    answer: Reply | Refusal | None = None
    abort_requested: bool = False


_SHOWN = 120
"""Largest number of characters of an unexpected answer in a sentence; a text may have thousands."""


class EpsonSession(EpsonConversation):
    """A conversation that several threads may share, and that ends for good when it is in doubt.

    Attributes:
        place: Where it was reached, the same for each spelling of the URL.
        exchanges: Requests sent so far.
        answers: How long the answers took, but for those of statements that take their time.
        latch: Refuses requests while a stop is active.
        settings_reset: How many requests were sent after which power and speed are set anew,
            whatever is read.

    Args:
        line: An open line; the session owns it from here on.
        timeout_s: Longest wait for the answer to one request that moves nothing.
    """

    def __init__(self, line: EpsonLine, *, timeout_s: float = 3.0) -> None:
        super().__init__(line, timeout_s=timeout_s)
        self.place = line.transport.place
        self.exchanges = 0
        self.answers = AnswerTimes(self.clock)
        self._wire = runtime.lock()
        self._gate = InterruptGate()
        self._gate.open()
        self._pending: PendingExecute | None = None
        self.latch = StopLatch(self.identity)
        self.settings_reset = 0

    @property
    def pending(self) -> PendingExecute | None:
        """The Execute that was not yet taken as finished, if any."""
        return self._pending

    @property
    def _under_way(self) -> bool:
        """Whether a statement that takes its time is not answered yet."""
        return self._pending is not None and self._pending.answer is None

    def carries(self, name: str) -> bool:
        """Whether a command of this name can be sent over this line."""
        return self._codec.carries(name)

    def ask(self, request: Request, *, secret: bool = False) -> Reply | Refusal:
        """Send one request and return whatever was answered; see :class:`EpsonConversation`."""
        what = self._announced(request)
        try:
            with self._gate, self._wire:
                self._admit(request, what)
                try:
                    self._expect_silence()
                    data = self._codec.send(request)
                    deadline = Deadline.after(self.clock, self.timeout_s)
                    self._transport.send(data, deadline=deadline, secret=secret)
                    self.exchanges += 1
                    sent_ns = self.clock.now_ns()
                    answer = self._receive(request, deadline, secret=secret)
                    self.answers.answered(sent_ns, moving=self._under_way)
                    return answer
                except RobolinkError as error:
                    self._end(error)
                    raise
        finally:
            checkpoint(_EXCHANGE, what)

    def start_execute(self, statement: Statement) -> PendingExecute:
        """Send a statement that takes its time; its answer is collected by name later."""
        request, pending = execution(statement), PendingExecute(statement)
        what = self._announced(request)
        try:
            with self._gate, self._wire:
                self._admit(request, what)
                try:
                    self._expect_silence()
                    # A request that the codec refuses is never sent, and nothing would end the wait
                    # for it. From here on a part may be sent, however the sending ends.
                    data = self._codec.send(request)
                    self._pending = pending
                    deadline = Deadline.after(self.clock, self.timeout_s)
                    self._transport.send(data, deadline=deadline)
                    self.exchanges += 1
                    self.answers.waited += 1
                except RobolinkError as error:
                    self._end(error)
                    raise
        finally:
            checkpoint(_EXCHANGE, what)
        return pending

    def uninterrupted(self) -> AbstractContextManager[None]:
        """Delay Ctrl-C over exchanges that belong together, then raise it."""
        return self._gate

    @property
    def interrupted(self) -> bool:
        """Whether Ctrl-C is being delayed just now."""
        return self._gate.interrupted

    def finish(self, pending: PendingExecute) -> None:
        """Forget an Execute whose answer was read."""
        if self._pending is pending:
            self._pending = None

    def await_pending(self, *, wait_s: float) -> None:
        """Wait up to ``wait_s`` for bytes, without the lock, then read what is there."""
        # The answer may have arrived together with that of the last request.
        self._collect()
        if self._pending is None or self._pending.answer is None:
            self._transport.wait_readable(deadline=Deadline.after(self.clock, wait_s))
            self._collect()

    def disowned(self, answer: str) -> RemoteProtocolError:
        """End the session, and return the error for an answer to another question."""
        error = _unasked(repr(answer))
        self._end(error)
        return error

    def close(self) -> None:
        """Close the connection. Idempotent."""
        super().close()
        self._gate.close()

    def _collect(self) -> None:
        with self._gate, self._wire:
            if self._ended_by is None:
                try:
                    self._expect_silence()
                except RobolinkError as error:
                    self._end(error)
                    raise

    def _announced(self, request: Request) -> str:
        """Return a request that this line can carry, for display, before the lock."""
        what = as_shown(request)
        if not self._codec.carries(request.name, *request.parameters):
            self._line.require_carried(request.name, *request.parameters)
        checkpoint(_LOCK, what)
        return what

    def _admit(self, request: Request, what: str) -> None:
        """Refuse, under the lock, what is not allowed now or a stop forbids."""
        checkpoint(_HELD, what)
        self._check_usable(request)
        self.latch.admit(command_class_of(request), what)
        if request.name.lower() in _SETS_BACK:
            self.settings_reset += 1
        if self._pending is not None and request.name == "Abort":
            # From here on, any end of the statement counts as requested.
            self._pending.abort_requested = True

    def _check_usable(self, request: Request) -> None:
        self._require_alive(request)
        if self._pending is not None and self._pending.answer is None:
            command = find_command(request.name)
            if command is None or not command.during_execute:
                raise BusyError(
                    tr(
                        "{name} must wait: a statement is still running on the controller.",
                        name=request.name,
                    ),
                    remedy=tr("Wait until the movement has ended, or stop it."),
                    controller=self.identity,
                    request=request.name,
                )

    def _answers(self, event: Reply | Refusal, wanted: str) -> bool:
        name = event.name.lower()
        # An answer without a name can be ours only if nothing else is outstanding.
        return name == wanted or (isinstance(event, Refusal) and not name and self._pending is None)

    def _expect_silence(self) -> None:
        """Read what has arrived without a request; only the pending Execute may answer by itself.

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
            raise self._closed_by_far_end()
        pending = self._pending
        if (
            isinstance(event, (Reply, Refusal))
            and event.name.lower() == "execute"
            and pending is not None
            and pending.answer is None
        ):
            pending.answer = event
            return
        raise _unasked("***" if hidden else repr(event))


def _unasked(answer: str) -> RemoteProtocolError:
    return RemoteProtocolError(
        tr(
            "The controller sent an answer that robolink did not ask for: {event}.",
            event=answer[:_SHOWN],
        ),
        remedy=tr("robolink closed the connection. Connect again, and look for a second program."),
    )


def log_in(line: EpsonLine, password: Secret | None, *, timeout_s: float) -> EpsonSession:
    """Log in over a line, which is closed when that fails.

    Raises:
        LoginRefusedError: Wrong or missing password. One attempt is made.
        LoginUnansweredError: Nobody answers; another client may be logged in.
        RemoteProtocolError: The answers on a serial line are not those to the questions.
    """
    session = EpsonSession(line, timeout_s=timeout_s)
    try:
        with Concerning(session.identity):
            session.login(password.reveal() if password else "")
        if line.outlives_sessions:
            _prove_in_step(session)
    except BaseException:
        session.close()
        raise
    return session


def _prove_in_step(session: EpsonSession) -> None:
    """Check that an answer belongs to its question, on a line that outlives its sessions.

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
        return  # a refusal is an answer too
    except (RemoteProtocolError, TransportTimeoutError) as error:
        error.remedy = tr("Connect again; if it happens twice, try numbers=ascii_hex in the URL.")
        raise


Opened = Callable[[Callable[[OutcomeLog], None]], Controller]
"""Logs in once and returns the controller; tells its record before."""


def alone(url: LinkUrl, terms: "ConnectionTerms", opened: Opened) -> Controller:
    """Log in to a controller that nobody else has.

    A second client is not answered, and is told nothing about the first one
    (docs/reference/epson.md 1.1). The record is: it names a process of this computer that is at
    work, before a connection is tried, and whoever has the lease, after a login that was not
    answered. That is tried a second time where somebody has recorded something meanwhile, and is
    gone.

    Args:
        url: The controller.
        terms: The terms of the connection.
        opened: Logs in.

    Raises:
        LeaseHeldError: Somebody has it; where a process of this computer responds, nothing was
            connected.
        LoginUnansweredError: Nobody answers, and nobody is known to have it.
        RobolinkError: As ``opened`` raises it.
    """
    before = None if terms.glance or url.medium == "sim" else _before(url, terms)
    try:
        return _named(url, terms, opened)
    except LoginUnansweredError:
        if before is None or before.newest == _newest(before.record):
            raise
    return _named(url, terms, opened)


@dataclass(frozen=True, slots=True)
class _Before:
    """What was on record before a login was tried.

    Attributes:
        record: Of the controller.
        newest: Number of its newest entry, 0 for none.
    """

    record: OutcomeLog
    newest: int


def _before(url: LinkUrl, terms: "ConnectionTerms") -> _Before | None:
    """Refuse while a process of this computer is at work; return what is on record.

    Raises:
        LeaseHeldError: One is.
    """
    with suppress(JournalError):  # whatever needs the journal says what is wrong with it
        record = terms.record_at(url.address)
        record.refuse_holder(silent=False)
        return _Before(record, _newest(record))
    return None


def _newest(record: OutcomeLog) -> int:
    return next((entry.number for entry in record.recorded()), 0)


def _named(url: LinkUrl, terms: "ConnectionTerms", opened: Opened) -> Controller:
    """Log in; if the only place is taken, say who has it, as far as that is on record."""
    told: list[OutcomeLog] = []
    try:
        return opened(told.append)
    except ConnectError:
        if not told and url.medium == SERIAL:  # its port is opened once
            told.append(terms.record_at(url.address))
        for record in told:
            with suppress(JournalError):
                record.look()
                record.refuse_holder(silent=True)
        raise
