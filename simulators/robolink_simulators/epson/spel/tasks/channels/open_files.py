"""Files 30 to 63 that the tasks of a controller have open (docs/reference/spel.md 18).

A file answers what a port answers (``ports.Ports``), so that Print #, Input #, Read and
their kin need not know which of them a number is.
"""

from dataclasses import dataclass
from typing import IO, TYPE_CHECKING, Final

from robolink_simulators.epson.refusals import RefusalKind, SpelRefusal
from robolink_simulators.epson.spel.expressions.values import LONGEST_STRING
from robolink_simulators.epson.spel.file_folder import FileFolder

if TYPE_CHECKING:
    from robolink_simulators.epson.spel.tasks.task import SpelTask

FILE_NUMBERS: Final = range(30, 64)
_END: Final = b"\r\n"
_LARGEST: Final = 64 * 1024 * 1024
"""Assumed, in bytes: a loop that only writes ends with an error, and not with a full disk."""

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
        """Write what is kept back (Flush)."""
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
        """Tell whether nothing is left to read (Eof)."""
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
        """Tell that nothing will come from elsewhere.

        Raises:
            Refusal: It is not open.
        """
        self._number(number)
        return False

    def foreign(self, number: int, task: "SpelTask") -> bool:
        """Tell whether a file is not this task's."""
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
