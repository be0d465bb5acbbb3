"""Lines that a person types, without those typed before there was a question.

A barcode scanner ends with CR and LF, a key stays down, a line is pasted, a file is fed in: what
waits in the input when a question is shown was never meant for it, and is dropped. A program that
answers reads the question first; one that knows its answers beforehand has options for them.
"""

import os
import queue
import sys
import threading
import time
import unicodedata
from importlib import import_module
from types import ModuleType
from typing import Any, Final, Protocol

from robolink_cli.console.person import is_terminal

BURST_S: Final = 1.0
"""Longest wait in seconds for the end of a burst: a key held down never ends."""

_LOOK_S: Final = 0.02
_ENDS: Final = "\r\n"
_BEFORE_A_CODE: Final = "\x00\xe0"
"""First character of an arrow or similar key. The next character is its code."""


class ConsoleLines:
    """Lines of a Windows console; a :class:`~robolink_cli.prompts.lines.Lines`.

    The console would edit lines itself. But then a read waits in it while the robot moves, takes
    the keys that are pressed meanwhile, and keeps what no ENTER has ended: nobody could drop that,
    and the next ENTER would send it. So keys are looked for only while an answer is awaited.

    Args:
        console: The module ``msvcrt``.
    """

    def __init__(self, console: Any) -> None:  # noqa: ANN401 - the module exists on Windows only
        self._console = console
        self._typed = ""

    def next(self, wait_s: float) -> str | None:
        """Return the next line; see :class:`~robolink_cli.prompts.lines.Lines`."""
        end_s = time.monotonic() + wait_s
        while True:
            while self._console.kbhit():
                line = self._pressed(self._console.getwch())
                if line is not None:
                    return line
            left_s = end_s - time.monotonic()
            if left_s <= 0:
                return None
            time.sleep(min(left_s, _LOOK_S))

    def forget(self, quiet_s: float) -> list[str]:
        """Discard what was typed; see :class:`~robolink_cli.prompts.lines.Lines`."""
        dropped, self._typed = self._typed, ""
        if dropped:
            self._show(_ENDS)
        end_s = time.monotonic() + BURST_S
        quiet_from_s = time.monotonic()
        while time.monotonic() < end_s:
            if self._console.kbhit():
                dropped += self._console.getwch()
                quiet_from_s = time.monotonic()
            elif time.monotonic() - quiet_from_s >= quiet_s:
                break
            else:
                time.sleep(0.005)
        return [_whole(line) for line in dropped.replace("\n", "\r").split("\r")[:-1]]

    def _pressed(self, character: str) -> str | None:
        """Take a key; return the line that it ends.

        Raises:
            EOFError: It ends the input, as Ctrl-Z does here.
        """
        if character in _ENDS:
            line, self._typed = self._typed, ""
            self._show(_ENDS)
            return _whole(line)
        if character in _BEFORE_A_CODE:
            self._console.getwch()
        elif character == "\x1a" and not self._typed:
            raise EOFError
        elif character == "\b":
            self._rub_out(1)
        elif character == "\x1b":
            self._rub_out(len(self._typed))
        elif character >= " ":
            self._typed += character
            self._show(character)
        return None

    def _rub_out(self, count: int) -> None:
        kept = self._typed[: len(self._typed) - count]
        gone, self._typed = self._typed[len(kept) :], kept
        for character in gone:
            columns = 2 if unicodedata.east_asian_width(character) in "WF" else 1
            self._show("\b" * columns + " " * columns + "\b" * columns)

    def _show(self, text: str) -> None:
        for character in text:
            self._console.putwch(character)


def _whole(line: str) -> str:
    """Return a line in which a character beyond U+FFFF, typed as two, is one."""
    return line.encode("utf-16-le", "surrogatepass").decode("utf-16-le", "replace")


QUIET_S: Final = 0.035
"""Pause in seconds that separates a person's keys. A scanner's characters come faster."""


class Lines(Protocol):
    """The source of typed lines."""

    def next(self, wait_s: float) -> str | None:
        """Return the next line, ``None`` if none comes within ``wait_s``.

        Raises:
            EOFError: The input has ended.
        """

    def forget(self, quiet_s: float) -> list[str]:
        """Discard what was typed so far, and return its complete lines.

        Args:
            quiet_s: How long nothing may come until the input counts as empty; 0 drops what is
                there and waits for nothing.
        """


def open_lines() -> Lines:
    """Return the lines of this process's stdin."""
    if not is_terminal(sys.stdin):
        return StreamLines()
    console = _module("msvcrt")
    if console is not None:
        return ConsoleLines(console)
    termios = _module("termios")
    try:
        descriptor = sys.stdin.fileno()
    except (OSError, ValueError, AttributeError):
        return StreamLines()
    return StreamLines() if termios is None else TerminalLines(descriptor, termios)


class TerminalLines:
    """Lines of a POSIX terminal, read without a thread, so that none is lost to one."""

    def __init__(self, descriptor: int, termios: Any) -> None:  # noqa: ANN401 - not on Windows
        self._descriptor = descriptor
        self._termios = termios
        self._held = b""

    def next(self, wait_s: float) -> str | None:
        """Return the next line; see :class:`Lines`."""
        if b"\n" not in self._held:
            data = self._read(wait_s)
            if data == b"":
                raise EOFError
            self._held += data or b""
        line, newline, rest = self._held.partition(b"\n")
        if not newline:
            return None
        self._held = rest
        return _text(line)

    def forget(self, quiet_s: float) -> list[str]:
        """Discard what was typed; see :class:`Lines`."""
        dropped, self._held = self._held, b""
        end_s = time.monotonic() + BURST_S
        while (data := self._read(quiet_s)) and time.monotonic() < end_s:
            dropped += data
        try:
            # And the text in a line that was not ended with ENTER.
            self._termios.tcflush(self._descriptor, self._termios.TCIFLUSH)
        except (OSError, self._termios.error):
            return []  # the terminal is gone; the next read reports it
        return [_text(line) for line in dropped.split(b"\n")[:-1]]

    def _read(self, wait_s: float) -> bytes | None:
        """Return what is there, empty at the end of the input, ``None`` when nothing comes."""
        import select

        ready, _, _ = select.select([self._descriptor], [], [], wait_s)
        if not ready:
            return None
        try:
            return os.read(self._descriptor, 4096)
        except OSError:  # EIO: the terminal is gone
            return b""


class StreamLines:
    """Lines of a file or a pipe, read by a thread."""

    def __init__(self) -> None:
        self._queue: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._reader: threading.Thread | None = None

    def next(self, wait_s: float) -> str | None:
        """Return the next line; see :class:`Lines`."""
        self._start()
        try:
            line = self._queue.get(timeout=wait_s)
        except queue.Empty:
            return None
        if line is None:
            self._queue.put(None)  # later readers find the end too
            raise EOFError
        return line

    def forget(self, quiet_s: float) -> list[str]:
        """Discard what was written; see :class:`Lines`."""
        self._start()
        dropped: list[str] = []
        end_s = time.monotonic() + BURST_S
        while time.monotonic() < end_s:
            try:
                line = self._queue.get(block=quiet_s > 0, timeout=quiet_s or None)
            except queue.Empty:
                break
            if line is None:
                self._queue.put(None)  # other readers find the end too
                break
            dropped.append(line.rstrip("\r\n"))
        return dropped

    def _start(self) -> None:
        if self._reader is None:
            self._reader = threading.Thread(target=self._read, name="prompt", daemon=True)
            self._reader.start()

    def _read(self) -> None:
        try:
            for line in sys.stdin or ():
                self._queue.put(line)
        finally:
            self._queue.put(None)


def _text(line: bytes) -> str:
    encoding = getattr(sys.stdin, "encoding", None) or "utf-8"
    return line.decode(encoding, "backslashreplace").rstrip("\r")


def _module(name: str) -> ModuleType | None:
    try:
        return import_module(name)
    except ImportError:
        return None
