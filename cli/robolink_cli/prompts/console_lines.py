"""Lines of a Windows console, taken key by key."""

import time
import unicodedata
from typing import Any, Final

BURST_S: Final = 1.0
"""Longest time in which a burst is waited out: a key that is held down never ends."""

_LOOK_S: Final = 0.02
_ENDS: Final = "\r\n"
_BEFORE_A_CODE: Final = "\x00\xe0"
"""An arrow or the like: another character follows, which is its code."""


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
        """Drop what was typed; see :class:`~robolink_cli.prompts.lines.Lines`."""
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
