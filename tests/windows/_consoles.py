"""Windows consoles on terminals of this machine, and a simulated hand at their keys."""

import fcntl
import os
import pty
import select
import socket
import struct
import termios
import time
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Final, Literal

import pyte
from robolink_cli.wizard.keys import ALONE_S
from robolink_simulators.control.assist import InProcessEyes
from robolink_simulators.epson.device import EpsonSimulator
from wcwidth import wcwidth

from tests.cli.wizard._hand_at_screen import HandAtScreen
from tests.windows._windows_python import WindowsPython

Way = Literal["calls", "sequences"]
PATIENCE_S: Final = 300.0
"""Long, because the judges run beside other work, and a console that wine draws is slow."""

_SCRIPT: Final = Path(__file__).with_name("_windows_console.py")


class WindowsConsole(HandAtScreen):
    """``robolink`` in a Windows console, made by ``_windows_console`` from wine's console.

    Args:
        python: The Windows Python.
        way: How the program draws and reads: by calls of the console or by escape sequences.
        words: The command line.
        environment: Additional environment variables of the program.
        folder: Its working folder.
        simulator: The simulator whose tip the hand sees.
        columns: Width of the console.
        rows: Height of the console.
        redirected: The redirection after the command line in cmd.exe, ``> file``.
    """

    longest_s = PATIENCE_S
    pause_s = 0.3

    def __init__(
        self,
        python: WindowsPython,
        way: Way,
        words: tuple[str, ...],
        environment: Mapping[str, str],
        folder: Path,
        simulator: EpsonSimulator | None = None,
        *,
        columns: int = 100,
        rows: int = 30,
        redirected: str = "",
    ) -> None:
        super().__init__(pyte.Screen(columns, rows), simulator and InProcessEyes(simulator))
        self._way = way
        self._gap = folder / "gap.txt"
        with socket.create_server(("127.0.0.1", 0)) as server:
            server.settimeout(PATIENCE_S)
            port = str(server.getsockname()[1])
            command = python.command(f"Z:{_SCRIPT}", way, port, *words)
            if redirected:
                _, *line = command
                command = ["wine", "cmd", "/c", f"{' '.join(line)} {redirected}"]
            self._child, self._terminal = pty.fork()
            if self._child == 0:
                size = struct.pack("HHHH", rows, columns, 0, 0)
                fcntl.ioctl(0, termios.TIOCSWINSZ, size)
                os.chdir(folder)
                os.execvpe(
                    command[0], command, python.environment({**environment, "TERM": "xterm"})
                )
            self._keys, _ = server.accept()
        self._over = False

    def read(self, seconds: float = 0.05) -> bool:
        """Read new output; return whether the program is still there."""
        ends = [end for end in (self._terminal, self._keys) if end is not None]
        ready, _, _ = select.select(ends, [], [], 0 if self._over else seconds)
        for end in ready:
            try:
                data = os.read(end if isinstance(end, int) else end.fileno(), 65536)
            except OSError:
                data = b""
            drawn_here = isinstance(end, int) == (self._way == "calls")
            if drawn_here:
                self.stream.feed(data)
            if not data:
                self._over = True
        return not self._over

    @property
    def text(self) -> str:
        """Return the text on the screen.

        If another character was drawn over the first half of a wide one, the second half is a
        blank.
        """
        for row in self.screen.buffer.values():
            for column in range(self.screen.columns):
                before = row[column - 1].data if column else ""
                if not row[column].data and wcwidth(before[:1] or " ") != 2:
                    row[column] = self.screen.default_char
        return "\n".join(self.screen.display)

    def send(self, key: str) -> None:
        """Press and release a key."""
        self._keys.sendall(f"{key}\n".encode())

    def scanned(self, how: str) -> bool:
        """Press keys faster than a hand does; return whether they arrived that fast."""
        self._gap.unlink(missing_ok=True)
        self.send(how)
        end_s = time.monotonic() + PATIENCE_S
        while not self._gap.exists():
            assert time.monotonic() < end_s, self.text
            self.read()
        return float(self._gap.read_text(encoding="utf-8")) < ALONE_S / 2

    def type(self, text: str, *, later_s: float = 1.0) -> None:
        """Write to the terminal, from which wine's own console makes keys; a person types later."""
        self.rest(later_s)
        os.write(self._terminal, text.encode())

    def close(self) -> None:
        """End a program that has not ended by itself."""
        with suppress(OSError):
            self.send("kill")
        self._keys.close()
        with suppress(OSError):
            os.close(self._terminal)

    def exit_code(self) -> int:
        """Wait for the end of the program; return its exit code."""
        end_s = time.monotonic() + PATIENCE_S
        while True:
            done, status = os.waitpid(self._child, os.WNOHANG)
            if done:
                return os.waitstatus_to_exitcode(status)
            assert time.monotonic() < end_s, self.text
            self.read(0.2)
            if self._over:
                time.sleep(0.1)
