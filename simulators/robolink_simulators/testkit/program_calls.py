"""Answers a simulated controller's SPEL+ program in the process of the test.

In place of the network of the program's port: no socket, no thread. The answer is there as soon as
the question has been sent, so that only the time of the controller decides what comes when.
"""

import errno
import socket
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from robolink.errors import LocalProtocolError, RemoteProtocolError
from robolink.protocols import NEED_DATA
from robolink.protocols.spel_callback import CallbackCodec, CallbackLine, encode_line

_END: Final = b"\r\n"


@dataclass(frozen=True, slots=True)
class CallFault:
    """The outcome of one question and its answer.

    Attributes:
        drop_question: The question is lost.
        drop_answer: It is answered, and the answer is lost.
        bend_question: A digit of the question is changed on its way.
        bend_answer: A digit of the answer is.
        cut_before: The connection ends before the question arrives.
        cut_after: It ends once the question was answered; the answer is lost.
    """

    drop_question: bool = False
    drop_answer: bool = False
    bend_question: bool = False
    bend_answer: bool = False
    cut_before: bool = False
    cut_after: bool = False


class ProgramAnswers(Protocol):
    """Who answers one program, as ``CallbackConversation`` does."""

    @property
    def over(self) -> bool:
        """Whether it has ended the conversation."""

    def answer(self, line: CallbackLine, /) -> CallbackLine:
        """Return the answer to a question."""

    def close(self) -> None:
        """End."""


class CallPartner(Protocol):
    """The other end of one connection of a program."""

    def ask(self, question: bytes, /) -> bytes:
        """Return the answer to a line, without its end; nothing where the connection ended."""

    def close(self) -> None:
        """End the connection."""


class AnsweredHere:
    """Answers a program in this process.

    Args:
        answers: Who answers, with whom the connection ends.
    """

    def __init__(self, answers: ProgramAnswers) -> None:
        self._answers = answers
        self._codec = CallbackCodec()
        self.close = answers.close

    def ask(self, question: bytes) -> bytes:
        """See :class:`CallPartner`."""
        if self._answers.over:
            return b""
        try:
            self._codec.receive(question + _END)
            line = self._codec.next_event()
            if line is NEED_DATA:
                return b""
            return encode_line(self._answers.answer(line)).removesuffix(_END)
        except (RemoteProtocolError, LocalProtocolError):
            return b""


class AnsweredAt:
    """Passes the questions of a program on to a server, and waits for each answer.

    Args:
        address: Of the server, on this computer.
    """

    def __init__(self, address: tuple[str, int]) -> None:
        self._link = socket.create_connection(address, timeout=30)
        self.close = self._link.close

    def ask(self, question: bytes) -> bytes:
        """See :class:`CallPartner`."""
        answer = b""
        try:
            self._link.sendall(question + _END)
            while not answer.endswith(_END):
                data = self._link.recv(4096)
                if not data:
                    return b""
                answer += data
        except OSError:
            return b""
        return answer.removesuffix(_END)


class ProgramCalls:
    """Stands in for the network of a simulated controller's program.

    Args:
        far: Makes the other end of one connection; what it raises of ``OSError`` refuses it.

    Attributes:
        questions: The lines of the program so far, without their ends.
        answers: What was answered; nothing where the connection ended instead.
        far: Makes the other end of the next connection.
        fault: Told number (from 0) and line of each question, returns what becomes of it.

    Example:
        >>> from pathlib import Path
        >>> from robolink.journal import memory_journal
        >>> from robolink.serving import CallbackConversation, CallbackLimits
        >>> from robolink_simulators.epson import EpsonSimulator
        >>> from robolink_simulators.testkit.program_calls import AnsweredHere, ProgramCalls
        >>> asking = '''
        ... Function main
        ...   SetNet #201, "127.0.0.1", 5001, CRLF
        ...   OpenNet #201 As Client
        ...   WaitNet #201
        ...   Print #201, "a line with a wrong sum"
        ...   Wait 1
        ...   Print ChkNet(201)
        ... Fend
        ... '''
        >>> program = Path.cwd() / "asking.prg"
        >>> written = program.write_text(asking)
        >>> def far():
        ...     journal = memory_journal("calls-example")
        ...     return AnsweredHere(CallbackConversation(journal, CallbackLimits(), peer="here"))
        >>> simulator, calls = EpsonSimulator(), ProgramCalls(far)
        >>> runner = simulator.load([program])
        >>> runner.ports.dial = calls.dial
        >>> simulator.panel.start_production()
        >>> while runner.tasks:
        ...     simulator.advance(simulator.next_change())
        >>> calls.questions, "".join(runner.console).strip()  # it is cut off: -1
        ([b'a line with a wrong sum'], '-1')
    """

    def __init__(self, far: Callable[[], CallPartner]) -> None:
        self.questions: list[bytes] = []
        self.answers: list[bytes] = []
        self.fault: Callable[[int, bytes], CallFault | None] = lambda _number, _question: None
        self.far = far
        self._call: _Call | None = None

    def dial(self, _address: tuple[str, int]) -> "_Call":
        """Connect a program; what it was connected to before is cut."""
        self.cut()
        try:
            self._call = _Call(self, self.far())
        except OSError:
            self._call = _Call(self, None)
        return self._call

    def cut(self) -> None:
        """Cut the connection, at both ends."""
        if self._call is not None:
            self._call.close()
        self._call = None

    def asked(self, line: bytes, far: CallPartner) -> bytes | None:
        """Return what the program receives for a question; ``None`` disconnects it."""
        self.questions.append(line)
        fault = self.fault(len(self.questions) - 1, line) or CallFault()
        if fault.cut_before:
            return None
        if fault.drop_question:
            return b""
        answer = far.ask(bent(line) if fault.bend_question else line)
        self.answers.append(answer)
        if not answer or fault.cut_after:
            return None
        if fault.drop_answer:
            return b""
        return (bent(answer) if fault.bend_answer else answer) + _END


class _Call:
    """One connection; see ``epson.spel.tasks.ports.PortLink``."""

    def __init__(self, calls: ProgramCalls, far: CallPartner | None) -> None:
        self._calls = calls
        self._far, self._there = far, far is not None
        self._asked = self._received = b""

    def setblocking(self, flag: bool, /) -> None:
        """Nothing here blocks."""

    def settimeout(self, value: float | None, /) -> None:
        """Nothing here waits."""

    def getsockopt(self, _level: int, _name: int, /) -> int:
        """Return why there is no connection, 0 where there is one."""
        return 0 if self._there else errno.ECONNREFUSED

    def getpeername(self) -> object:
        """Return who is at the other end."""
        if not self._there:
            raise ConnectionRefusedError
        return "the process of the test"

    def sendall(self, data: bytes, /) -> None:
        """Ask; the answer is there at once."""
        self._asked += data
        while _END in self._asked:
            if self._far is None:
                raise BrokenPipeError
            line, _, self._asked = self._asked.partition(_END)
            answer = self._calls.asked(line, self._far)
            if answer is None:
                self.close()
            else:
                self._received += answer

    def recv(self, most: int, /) -> bytes:
        """Take what has come; nothing once the connection has ended."""
        taken, self._received = self._received[:most], self._received[most:]
        if not taken and self._far is not None:
            raise BlockingIOError
        return taken

    def close(self) -> None:
        """Hang up."""
        far, self._far = self._far, None
        if far is not None:
            far.close()


def bent(line: bytes) -> bytes:
    """Return a line with one digit changed, the last before its sum."""
    digits = [index for index, byte in enumerate(line[:-8]) if chr(byte).isdigit()]
    if not digits:
        return line[::-1]
    at = digits[-1]
    return line[:at] + bytes([ord("0") + (line[at] - ord("0") + 1) % 10]) + line[at + 1 :]
