"""Single keys of this process's terminal, where the system has a way to read them.

The modules that do it exist on one kind of system each, so they are looked for when a
keyboard is opened, never at import.
"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from types import ModuleType
from typing import Any, Final, Protocol

from robolink.errors import ConfigError
from robolink.messages import tr
from robolink_cli.prompts.keys import PLAIN, WINDOWS, Key, KeyDecoder

_POLL_S: Final = 0.02
_ESCAPE_S: Final = 0.05
"""What ends a sequence that never ended: ESC was pressed alone."""


class Keyboard(Protocol):
    """Where keys come from."""

    def read(self, wait_s: float) -> list[Key]:
        """Return the keys pressed, waiting for one at most ``wait_s``.

        Raises:
            EOFError: The terminal is gone.
        """


@contextmanager
def keyboard() -> Iterator[Keyboard]:
    """Read single keys of this process's terminal; it is as it was afterwards.

    Raises:
        ConfigError: There is no terminal, or no way to read single keys from it.
    """
    termios = _module("termios")
    console = None if termios else _module("msvcrt")
    if not sys.stdin.isatty() or (termios is None and console is None):
        raise ConfigError(
            tr("This window cannot read single keys. Type steps instead."),
            remedy=tr("Run it on a terminal, or type steps: robolink robot jog x+0.1"),
        )
    if termios is None:
        yield WindowsKeyboard(console)
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    try:
        # Ctrl-C stays what it is: only echo and the wait for a whole line are switched off.
        import_module("tty").setcbreak(descriptor)
        yield PosixKeyboard(descriptor)
    finally:
        # Flushed, so that keys still held down do not land in the shell.
        termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)


class PosixKeyboard:
    """Keys of a POSIX terminal in cbreak mode."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._decoder = KeyDecoder()

    def read(self, wait_s: float) -> list[Key]:
        """Return the keys pressed; see :class:`Keyboard`."""
        keys = []
        text = self._characters(wait_s)
        while text:
            keys += self._decoder.feed(text)
            text = self._characters(_ESCAPE_S if self._decoder.pending else 0)
        self._decoder.flush()
        return keys

    def _characters(self, wait_s: float) -> str:
        import os
        import select

        ready, _, _ = select.select([self._descriptor], [], [], wait_s)
        if not ready:
            return ""
        try:
            data = os.read(self._descriptor, 1024)
        except OSError as error:
            raise EOFError from error
        if not data:
            raise EOFError
        return data.decode("latin-1")


class WindowsKeyboard:
    """Keys of a Windows console, read with ``msvcrt``."""

    def __init__(self, console: Any) -> None:  # noqa: ANN401 - the module exists on Windows only
        self._console = console

    def read(self, wait_s: float) -> list[Key]:
        """Return the keys pressed; see :class:`Keyboard`."""
        import time

        end_s = time.monotonic() + wait_s
        while not self._console.kbhit():
            if time.monotonic() >= end_s:
                return []
            time.sleep(_POLL_S)
        keys = []
        while self._console.kbhit():
            character = self._console.getwch()
            if character == "\x03":
                raise KeyboardInterrupt
            table = PLAIN
            if character in ("\x00", "\xe0"):
                character, table = self._console.getwch(), WINDOWS
            if character in table:
                keys.append(table[character])
        return keys


def _module(name: str) -> ModuleType | None:
    try:
        return import_module(name)
    except ImportError:
        return None
