"""The wizard's full screen in a Windows console that wine draws on a pseudo terminal.

wine 8 takes the mode in which a console obeys escape sequences, and does not obey them. So the
program is told that its console has no such mode, as an older Windows, or cmd.exe in legacy mode,
says: prompt_toolkit draws by calls of the console then. Its other way is not judged here.
"""

import fcntl
import os
import pty
import re
import select
import struct
import termios
import time
from pathlib import Path
from typing import Final

import pyte
import pytest

from tests.windows._windows_python import ROOT, WindowsPython

CELL: Final = """
[cells.line3]
url = "epson+sim://full-face?seed=3"
remote_timeout_s = 60
remote_timeout_confirmed_by = "the test: it is a simulator"
"""
_WITHOUT_ESCAPES: Final = """
import prompt_toolkit.output.windows10 as console
console.is_win_vt100_enabled = lambda: False
from robolink_cli.entry import main
main()
"""
_PATIENCE_S: Final = 120
_ROWS: Final = 30


class WineConsole:
    """A terminal of some width with a program of Windows in it, and what stands on it."""

    def __init__(
        self, command: list[str], environment: dict[str, str], folder: Path, columns: int
    ) -> None:
        self._screen = pyte.Screen(columns, _ROWS)
        self._stream = pyte.ByteStream(self._screen)
        self._child, self._terminal = pty.fork()
        if self._child == 0:
            fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", _ROWS, columns, 0, 0))
            os.chdir(folder)
            os.execvpe(command[0], command, environment)

    @property
    def rows(self) -> list[str]:
        """What stands on it, row by row."""
        return [row.rstrip() for row in self._screen.display]

    def wait_for(self, text: str) -> list[str]:
        """Read on until a text stands there; return the rows, when they have come to rest."""
        end = time.monotonic() + _PATIENCE_S
        while not any(text in row for row in self.rows) or self._more(0.7):
            assert time.monotonic() < end, "\n".join(self.rows)
            self._more(0.5)
        return self.rows

    def press(self, keys: str) -> None:
        """Press keys as a person does who has read the screen."""
        time.sleep(1.0)
        os.write(self._terminal, keys.encode())

    def exit_code(self) -> int:
        """Wait for the end of the program."""
        end = time.monotonic() + _PATIENCE_S
        while True:
            done, status = os.waitpid(self._child, os.WNOHANG)
            if done:
                return os.waitstatus_to_exitcode(status)
            assert time.monotonic() < end, "\n".join(self.rows)
            self._more(0.5)

    def _more(self, wait_s: float) -> bool:
        """Take what comes within so long; tell whether the text on the screen changed."""
        before = self.still
        if select.select([self._terminal], [], [], wait_s)[0]:
            try:
                self._stream.feed(os.read(self._terminal, 65536))
            except OSError:  # the program has ended
                time.sleep(wait_s)
        return self.still != before

    @property
    def still(self) -> list[str]:
        """The rows without the age of the reading, which is drawn anew for ever."""
        return [re.sub(r"reading [0-9.]+ s", "", row) for row in self.rows]


@pytest.fixture
def start(windows: WindowsPython, state: dict[str, str], tmp_path: Path):
    """Return what starts ``change`` in a console of so many columns."""
    (tmp_path / "robolink.toml").write_text(CELL)
    recipe = ROOT / "examples" / "recipes" / "scara-pin.toml"
    (tmp_path / "needle.toml").write_bytes(recipe.read_bytes())
    words = ("-c", _WITHOUT_ESCAPES, "--lang", "en", "-c", "line3", "change", "needle.toml")
    environment = windows.environment({**state, "TERM": "xterm"})
    return lambda columns: WineConsole(windows.command(*words), environment, tmp_path, columns)


def test_the_full_screen_is_drawn_takes_keys_and_is_left(start):
    console = start(100)
    rows = console.wait_for("Scan the id of the new needle.")
    assert rows[0].startswith("line3   Change needle")
    assert rows[0].endswith("SIMULATED")
    assert rows[1].startswith("READY   power LOW   tool 1 selected   reading")
    assert [row for row in rows if row.startswith("-")] == ["-" * 80] * 2
    assert any(row.startswith("[Enter] Done") and row.endswith("[Esc] STOP") for row in rows)
    console.press("N-7")
    console.wait_for("> N-7_")
    console.press("\r")
    rows = console.wait_for("Start moving (2 open)")
    assert sum(row.startswith(" OK ") for row in rows) == 4
    console.press("1")
    rows = console.wait_for("Start moving (1 open)")
    assert sum(row.startswith(" OK ") for row in rows) == 5
    console.press("0")
    console.wait_for("Nothing was moved. Nothing was written. Tool 1 is selected.")
    assert console.exit_code() == 9


def test_a_console_of_80_columns_gets_the_dialogue_of_lines_at_once(start):
    console = start(80)
    rows = console.wait_for("scan it, then Enter. To end: stop.]")
    assert not [row for row in rows if "STOP" in row or row.startswith("---")]
    console.press("stop\r")
    assert console.exit_code() == 9
