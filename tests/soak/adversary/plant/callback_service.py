"""The service that a program calls, and its line, in virtual time and without a socket."""

import errno
from collections.abc import Callable
from typing import Final, cast

from robolink_simulators.cell.clock import ManualClock

from robolink.errors import LocalProtocolError, RemoteProtocolError, RobolinkError
from robolink.journal import Journal, JournalOutcomeLog
from robolink.model import MarkerKind, Signature, ToolOffset
from robolink.protocols import NEED_DATA
from robolink.protocols.spel_callback import CallbackCodec, CallbackWord, encode_line
from robolink.serving import CallbackConversation, CallbackLimits
from robolink.timing import NS_PER_S
from tests.soak.adversary.computer import VirtualProcess
from tests.soak.adversary.history import CountedActs
from tests.soak.adversary.rules.grounds import TOLERANCE_MM
from tests.soak.adversary.surroundings import Killed, TurnTaking

LIMITS: Final = CallbackLimits(tolerance_mm=TOLERANCE_MM, max_change_mm=2.0, sigma_mm=0.01)
_BEAT_NS: Final = NS_PER_S
_PEER: Final = "127.0.0.1"


class ProgramService:
    """Answers a program as ``robolink expert serve`` does, in one process that may die.

    Args:
        clock: The virtual time.
        turns: Knows the running process.
        note: Receives the traffic.
        on_record: Name under which the controller is recorded.

    Attributes:
        acts: Disturbances planned for the exchanges.
        process: The serving process; ``None`` for none.
        on_record: The controller's name in the record of a PC, as a person gives it to
            ``robolink expert serve``.
        on_question: Receives each question of the program.
        on_value: Receives each value given to the program.
        on_refusal: Receives each refusal as the screen shows it: its code, and the error.
    """

    def __init__(
        self,
        clock: ManualClock,
        turns: TurnTaking,
        note: Callable[[VirtualProcess, str], None],
        *,
        on_record: str,
    ) -> None:
        self._on_record = on_record
        self.acts = CountedActs()
        self.process: VirtualProcess | None = None
        self.on_question: Callable[[str], None] = lambda _text: None
        self.on_value: Callable[[ToolOffset], None] = lambda _value: None
        self.on_refusal: Callable[[str, RobolinkError], None] = lambda _code, _error: None
        self._clock = clock
        self._turns = turns
        self._note = note
        self._line: ProgramLine | None = None
        self._beaten_ns = 0

    def begin(self, process: VirtualProcess) -> None:
        """Let a process serve from now on, with its open journal."""
        self.process = process

    def end(self) -> None:
        """Stop serving; the system closes the line."""
        if self._line is not None:
            self._line.cut()
        self._line = self.process = None

    def dial(self, _address: tuple[str, int]) -> "ProgramLine":
        """Connect a program; nothing listens while no process serves."""
        if self._line is not None:
            self._line.cut()
        self._line = ProgramLine(self, there=self._serving)
        return self._line

    @property
    def _serving(self) -> bool:
        return self.process is not None and self.process.alive

    def conversation(self) -> CallbackConversation:
        """Begin a conversation with a program, with the journal of the process."""
        journal = cast(Journal, _OpenJournal(self))
        return CallbackConversation(
            journal,
            LIMITS,
            peer=_PEER,
            controllers=(self._on_record,),
            tell=self.on_refusal,
        )

    def log(self, controller: str) -> JournalOutcomeLog:
        """Return the record of a controller, kept by the serving process."""
        assert self.process is not None  # for the type: who talks is served
        return self.process.log_of(controller, self._clock)

    def lacks_record(self) -> bool:
        """Whether the controller's record is missing and no person has looked yet."""
        open_markers = self.log(self._on_record).open_markers()
        return any(marker.kind is MarkerKind.HISTORY for marker in open_markers)

    def within(self, work: Callable[[], bytes]) -> bytes | None:
        """Run something in the serving process; ``None`` if the process died of it."""
        process, me = self.process, self._turns.current
        if process is None or not process.alive:
            return None
        outer, me.owner = me.owner, process
        try:
            return work()
        except Killed:
            return None
        finally:
            me.owner = outer

    def asked(self, line: bytes) -> bytes | None:
        """Return the outcome of a question: its answer, nothing, or ``None`` for the end."""
        text = line.decode("ascii", "replace")
        self.on_question(text)
        acts = {disturbance.what for disturbance in self.acts.due(text)}
        if "CUT_BEFORE" in acts:
            return None
        if "DROP_ASKED" in acts:
            return b""
        asked = _bent(line) if "BEND_ASKED" in acts else line
        answer = self.within(lambda: self._answered(asked))
        if not answer or "CUT_AFTER" in acts:
            return None
        if "DROP_ANSWERED" in acts:
            return b""
        return _bent(answer) if "BEND_ANSWERED" in acts else answer

    def beat(self) -> None:
        """Show others, once a second, that a change is under way."""
        now_ns = self._clock.now_ns()
        if self._line is not None and now_ns - self._beaten_ns >= _BEAT_NS:
            self._beaten_ns = now_ns
            self.within(self._line.beaten)

    def _answered(self, line: bytes) -> bytes:
        process = self.process
        if process is None or self._line is None:
            return b""
        self._note(process, f"wire received {line!r}")
        answer = self._line.answered(line)
        self._note(process, f"wire sent {answer!r}")
        return answer


class _OpenJournal:
    """The journal functions that a conversation needs."""

    def __init__(self, service: ProgramService) -> None:
        self._service = service

    def log(self, controller: str, *, signature: Signature) -> JournalOutcomeLog:
        return self._service.log(controller)


class ProgramLine:
    """A program's connection; see ``epson.spel.tasks.ports.PortLink``.

    Args:
        service: The service that answers.
        there: Whether it is running.
    """

    def __init__(self, service: ProgramService, *, there: bool) -> None:
        self._service = service
        self._there = there
        self._ended = False
        self._received = b""
        self._asked = b""
        self._codec = CallbackCodec()
        self._conversation = service.conversation()

    def setblocking(self, flag: bool, /) -> None:
        """Do nothing: no call blocks."""

    def settimeout(self, value: float | None, /) -> None:
        """Do nothing: no call waits."""

    def getsockopt(self, _level: int, _name: int, /) -> int:
        """Return the reason for a failed connection, 0 for an open one."""
        return 0 if self._there else errno.ECONNREFUSED

    def getpeername(self) -> object:
        """Return the address of the other end."""
        if not self._there:
            raise ConnectionRefusedError
        return _PEER

    def sendall(self, data: bytes, /) -> None:
        """Send a question; the answer is there at once."""
        if self._ended:
            raise BrokenPipeError
        self._asked += data
        while b"\r\n" in self._asked and not self._ended:
            line, _, self._asked = self._asked.partition(b"\r\n")
            answer = self._service.asked(line)
            if answer is None:
                self.cut()
            else:
                self._received += answer

    def recv(self, most: int, /) -> bytes:
        """Return what has arrived."""
        taken, self._received = self._received[:most], self._received[most:]
        if not taken and not self._ended:
            raise BlockingIOError
        return taken

    def close(self) -> None:
        """Hang up."""
        self.cut()

    def cut(self) -> None:
        """End the connection at both ends."""
        if not self._ended:
            self._ended = True
            self._service.within(self._closed)

    def answered(self, line: bytes) -> bytes:
        """Have a question answered; nothing if it is malformed."""
        self._codec.receive(line + b"\r\n")
        try:
            event = self._codec.next_event()
            if event is NEED_DATA:
                return b""
            answer = self._conversation.answer(event)
            if answer.word == CallbackWord.VALUE:
                x, y, z, u, v, w = (int(text) / 1000 for text in answer.fields[1:])
                self._service.on_value(ToolOffset(x, y, z, u, v, w))
            return encode_line(answer)
        except (RemoteProtocolError, LocalProtocolError):
            return b""

    def beaten(self) -> bytes:
        """Send a sign of life."""
        try:
            self._conversation.beat()
        except RobolinkError:
            self._ended = True
        return b""

    def _closed(self) -> bytes:
        self._conversation.close()
        return b""


def _bent(line: bytes) -> bytes:
    """Return a line with one digit changed."""
    digits = [index for index, byte in enumerate(line[:-8]) if chr(byte).isdigit()]
    if not digits:
        return line[::-1]
    at = digits[-1]
    return line[:at] + bytes([ord("0") + (line[at] - ord("0") + 1) % 10]) + line[at + 1 :]
