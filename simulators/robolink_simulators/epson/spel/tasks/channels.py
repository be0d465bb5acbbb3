"""The targets of Print #, Input # and their kin: ports by number, files, a person's window.

Files 30 to 63 that the tasks of a controller have open (docs/reference/spel.md 18).

A file answers what a port answers (``ports.Ports``), so that Print #, Input #, Read and
their kin need not know which of them a number is.

The window in which a person answers Input (docs/reference/spel.md 17).

Which port, file or window a number stands for (docs/reference/spel.md 17, 18).
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Final

from robolink_simulators.epson.condition import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.print_format import CRLF
from robolink_simulators.epson.spel.expressions.values import LONGEST_STRING
from robolink_simulators.epson.spel.file_folder import FileFolder
from robolink_simulators.epson.spel.tasks.ports import Ports

if TYPE_CHECKING:
    from robolink_simulators.epson.spel.tasks.task import SpelTask


FILE_NUMBERS: Final = range(30, 64)
_END: Final = b"\r\n"
_LARGEST: Final = 64 * 1024 * 1024
"""Largest file in bytes (assumed). A loop that only writes ends in an error instead of filling the
disk.
"""

_WAYS: Final = {"r": "rb", "w": "wb", "a": "ab", "u": "r+b", "b": "r+b"}


@dataclass(slots=True)
class _OpenFile:
    stream: IO[bytes]
    owner: "SpelTask"
    reads: bool
    writes: bool
    binary: bool


class OpenFiles:
    """The files that are open.

    Args:
        folder: Where they lie.
    """

    def __init__(self, folder: FileFolder) -> None:
        self._folder = folder
        self._files: dict[int, _OpenFile] = {}

    def open(self, number: int, name: str, way: str, task: "SpelTask") -> None:
        """Open a file: ``r`` to read, ``w`` anew, ``a`` at its end, ``u`` both, ``b`` binary.

        With ``u`` and ``b`` one that is not there is made (assumed).

        Raises:
            Refusal: The number is in use, or the file cannot be opened.
        """
        if number not in FILE_NUMBERS:
            raise SpelRefusal(RefusalKind.VALUE_OUT_OF_RANGE, f"There is no file {number}")
        if number in self._files:
            raise SpelRefusal(RefusalKind.FILE_NUMBER_IN_USE, f"File {number} is open")
        path = self._folder.path(name)
        try:
            if way in "ub":
                path.touch()
            stream = open(path, _WAYS[way])  # noqa: SIM115 - closed by Close, or at the end
        except OSError as error:
            text = f"{name}: {error.strerror}"
            raise SpelRefusal(RefusalKind.FILE_OPENING, text) from error
        self._files[number] = _OpenFile(stream, task, way in "rub", way in "waub", way == "b")

    def close(self, number: int) -> None:
        """Close a file.

        Raises:
            Refusal: It is not open.
        """
        self._number(number)
        self._files.pop(number).stream.close()

    def close_of(self, task: "SpelTask") -> None:
        """Close the files of a task."""
        for number in [n for n, file in self._files.items() if file.owner is task]:
            self.close(number)

    def close_all(self) -> None:
        """Close every file."""
        for number in list(self._files):
            self.close(number)

    def free_number(self) -> int:
        """Return a number that is not in use (FreeFile).

        Raises:
            Refusal: All are.
        """
        free = next((n for n in FILE_NUMBERS if n not in self._files), None)
        if free is None:
            raise SpelRefusal(RefusalKind.FILE_NUMBERS_USED, "All numbers of files are in use")
        return free

    def flush(self, number: int, task: "SpelTask") -> None:
        """Write the buffered data (Flush)."""
        self._of(number, task).stream.flush()

    def seek(self, number: int, position: int, task: "SpelTask") -> None:
        """Go to a byte, counted from 0.

        Raises:
            Refusal: It lies before the file.
        """
        if position < 0:
            raise SpelRefusal(RefusalKind.FILE_SEEKING, f"There is no byte {position}")
        self._of(number, task).stream.seek(position)

    def at_end(self, number: int, task: "SpelTask") -> bool:
        """Return whether nothing is left to read (Eof)."""
        return self.waiting_bytes(number, task) == 0

    def require_binary(self, number: int, task: "SpelTask") -> None:
        """Refuse ReadBin and WriteBin on a file that BOpen did not open.

        Raises:
            Refusal: It is none.
        """
        if not self._of(number, task).binary:
            raise SpelRefusal(RefusalKind.FILE_NOT_BINARY, f"File {number} is not binary")

    def timeout_s(self, number: int) -> float:  # noqa: ARG002 - as a port has one
        """Return 0: nothing comes later."""
        return 0.0

    def connected(self, number: int) -> bool:
        """Return that nothing will come from elsewhere.

        Raises:
            Refusal: It is not open.
        """
        self._number(number)
        return False

    def foreign(self, number: int, task: "SpelTask") -> bool:
        """Return whether a file belongs to another task."""
        return self._number(number).owner is not task

    def waiting_bytes(self, number: int, task: "SpelTask") -> int:
        """Return how many bytes are left to read."""
        stream = self._readable(number, task).stream
        at = stream.tell()
        end = stream.seek(0, 2)
        stream.seek(at)
        return max(0, end - at)

    def lines(self, number: int, task: "SpelTask") -> int:
        """Return how many lines are left, a last one without an end too (Lof)."""
        stream = self._readable(number, task).stream
        at = stream.tell()
        rest = stream.read()
        stream.seek(at)
        return rest.count(b"\n") + (not rest.endswith(b"\n") and bool(rest))

    def line(self, number: int, task: "SpelTask") -> str:
        """Take a line without its end, CR LF or LF.

        Raises:
            Refusal: None is left, or it is longer than a string can be.
        """
        data = self._readable(number, task).stream.readline()
        if not data:
            raise SpelRefusal(RefusalKind.FILE_READING, f"File {number} is at its end")
        text = data.rstrip(b"\r\n").decode(self._folder.encoding, errors="replace")
        if len(text) > LONGEST_STRING:
            raise SpelRefusal(RefusalKind.FILE_READING, f"A line of {len(text)} characters")
        return text

    def write(self, number: int, text: str, task: "SpelTask", *, ends: bool) -> None:
        """Write a text, with CR LF if it ends a line.

        Raises:
            Refusal: The file was opened to be read, or is too large.
        """
        data = text.encode(self._folder.encoding, errors="replace")
        self.write_bytes(number, data + (_END if ends else b""), task)

    def write_bytes(self, number: int, data: bytes, task: "SpelTask") -> None:
        """Write bytes; see :meth:`write`."""
        file = self._of(number, task)
        if not file.writes:
            raise SpelRefusal(RefusalKind.FILE_NOT_WRITABLE, f"File {number} is only read")
        try:
            if file.stream.tell() + len(data) > _LARGEST:
                raise OSError(0, "too large")
            file.stream.write(data)
        except OSError as error:
            text = f"File {number}: {error.strerror}"
            raise SpelRefusal(RefusalKind.FILE_WRITING, text) from error

    def bytes(self, number: int, count: int, task: "SpelTask") -> bytes:
        """Take so many bytes, or those that are left.

        Raises:
            Refusal: None is left.
        """
        data = self._readable(number, task).stream.read(count)
        if count and not data:
            raise SpelRefusal(RefusalKind.FILE_READING, f"File {number} is at its end")
        return data

    def _readable(self, number: int, task: "SpelTask") -> _OpenFile:
        file = self._of(number, task)
        if not file.reads:
            raise SpelRefusal(RefusalKind.FILE_NOT_READABLE, f"File {number} is only written")
        return file

    def _of(self, number: int, task: "SpelTask") -> _OpenFile:
        file = self._number(number)
        if file.owner is not task:
            raise SpelRefusal(RefusalKind.FILE_OF_OTHER_TASK, f"File {number}: another task")
        return file

    def _number(self, number: int) -> _OpenFile:
        file = self._files.get(number)
        if file is None:
            raise SpelRefusal(RefusalKind.FILE_NOT_OPEN, f"File {number} is not open")
        return file


WINDOW_NUMBERS: Final = (20, 21, 24)
"""Channel numbers of a pendant, RC+ and another pendant: all the same window here
(docs/reference/spel.md 17).
"""

USUAL_WINDOW: Final = 21


class OperatorWindow:
    """Lines that a person types, in the order in which tasks ask for them.

    Args:
        show: Shows a text.

    Attributes:
        answers: What was typed and nobody has asked for yet.
        ask: Asks a person for the next line when there is none; ``None`` from it means that nobody
            will answer any more. Without it tasks wait until a line stands in ``answers``.
    """

    def __init__(self, show: Callable[[str], None]) -> None:
        self.answers: deque[str] = deque()
        self.ask: Callable[[], str | None] | None = None
        self._show = show
        self._prompted = False
        self._closed = False

    def type(self, *lines: str) -> None:
        """Type lines."""
        self.answers.extend(lines)

    def lines(self, number: int, task: "SpelTask") -> int:  # noqa: ARG002 - as a port has them
        """Return how many lines are there; if there is none, ask (documented: a ``?`` shows)."""
        if not self._prompted:
            self._show("?")
            self._prompted = True
        if not self.answers and self.ask is not None and not self._closed:
            answer = self.ask()
            if answer is None:
                self._closed = True
            else:
                self.answers.append(answer)
        return len(self.answers)

    def line(self, number: int, task: "SpelTask") -> str | None:  # noqa: ARG002 - as a port has it
        """Take a line; ``None`` while there is none.

        Raises:
            Refusal: Nobody answers any more, or it is longer than a string can be.
        """
        if not self.answers:
            if self._closed:
                raise SpelRefusal(RefusalKind.INPUT_COUNT, "Nobody answers")
            return None
        self._prompted = False
        text = self.answers.popleft()
        if len(text) > LONGEST_STRING:
            raise SpelRefusal(RefusalKind.PORT_LINE_TOO_LONG, f"A line of {len(text)} characters")
        return text

    def timeout_s(self, number: int) -> float:  # noqa: ARG002 - as a port has one
        """Return 0: a person has all the time there is."""
        return 0.0

    def connected(self, number: int) -> bool:  # noqa: ARG002 - as a port tells it
        """Return whether somebody may answer."""
        return not self._closed

    def foreign(self, number: int, task: "SpelTask") -> bool:  # noqa: ARG002 - as a port tells it
        """Return that the window belongs to every task."""
        return False

    def write(self, number: int, text: str, task: "SpelTask", *, ends: bool) -> None:  # noqa: ARG002
        """Show a text, as Print does."""
        self._show(text + (CRLF if ends else ""))

    def write_bytes(self, number: int, data: bytes, task: "SpelTask") -> None:  # noqa: ARG002
        """Refuse WriteBin.

        Raises:
            Refusal: Always.
        """
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "Bytes to a window")

    def bytes(self, number: int, count: int, task: "SpelTask") -> bytes:  # noqa: ARG002
        """Refuse Read and ReadBin: the window has lines.

        Raises:
            Refusal: Always.
        """
        raise SpelRefusal(RefusalKind.NOT_SIMULATED, "Bytes from a window")

    def waiting_bytes(self, number: int, task: "SpelTask") -> int:  # noqa: ARG002
        """Return 0; see :meth:`bytes`."""
        return 0

    def require_binary(self, number: int, task: "SpelTask") -> None:
        """Let the statement find out itself; see :meth:`bytes`."""


class NumberedChannels:
    """The targets of Print #, Input # and their kin.

    Args:
        ports: The ports of the controller.
        folder: Where its files lie.
        show: Shows a text to a person.
        keeps_ports: Whether the ports of a task that ends stay open.

    Attributes:
        ports: The ports of the controller.
        files: The files that are open.
        window: Where a person answers Input.
    """

    def __init__(
        self, ports: Ports, folder: FileFolder, show: Callable[[str], None], *, keeps_ports: bool
    ) -> None:
        self.ports = ports
        self.files = OpenFiles(folder)
        self.window = OperatorWindow(show)
        self._keeps_ports = keeps_ports

    def of(self, number: int) -> Ports | OpenFiles | OperatorWindow:
        """Return the channel of a number; an unused number is a port that does not exist."""
        if number in WINDOW_NUMBERS:
            return self.window
        return self.files if number in FILE_NUMBERS else self.ports

    def close_of(self, task: "SpelTask") -> None:
        """Close what a finished task had open."""
        self.files.close_of(task)
        if not self._keeps_ports:
            self.ports.close_of(task)

    def close_all(self) -> None:
        """Close everything."""
        self.files.close_all()
        self.ports.close_all()
