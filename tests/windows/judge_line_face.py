"""The wizard's dialogue of lines in a Windows console that wine draws on a pseudo terminal."""

import os
import pty
import re
import select
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest
from robolink_simulators.cell.clock import ScaledClock
from robolink_simulators.epson.device import EpsonSimulator
from robolink_simulators.hosting.streams.epson_tcp import serve_tcp

from tests.windows._windows_python import ROOT, WindowsPython

RECIPE: Final = ROOT / "examples" / "recipes" / "scara-pin.toml"
CELL: Final = """
[cells.line3]
url = "{url}"
remote_timeout_s = 60
remote_timeout_confirmed_by = "the test: it is a simulator"
"""
_DRAWING: Final = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]|\x1b\][^\x07]*\x07")
_PATIENCE_S: Final = 120


class Console:
    """A terminal with a program of Windows in it."""

    def __init__(self, command: list[str], environment: dict[str, str], folder: Path) -> None:
        self.said = ""
        self._child, self._terminal = pty.fork()
        if self._child == 0:
            os.chdir(folder)
            os.execvpe(command[0], command, environment)

    def wait_for(self, text: str) -> None:
        """Read on until a text stands there; what came before it is forgotten."""
        end = time.monotonic() + _PATIENCE_S
        while text not in (plain := " ".join(_DRAWING.sub("", self.said).split())):
            assert time.monotonic() < end, plain[-1500:]
            if select.select([self._terminal], [], [], 0.5)[0]:
                self.said += os.read(self._terminal, 65536).decode("utf-8", "replace")
        self.said = plain[plain.index(text) + len(text) :]

    def type(self, line: str) -> None:
        """Type a line, as a person would who has read the question first."""
        time.sleep(1.0)
        os.write(self._terminal, f"{line}\r".encode())

    def exit_code(self) -> int:
        """Wait for the end of the program."""
        while True:
            try:
                if not os.read(self._terminal, 65536):
                    break
            except OSError:
                break
        return os.waitstatus_to_exitcode(os.waitpid(self._child, 0)[1])


@pytest.fixture
def simulator() -> Iterator[tuple[EpsonSimulator, str]]:
    """A simulated controller of this machine, and its address."""
    simulated = EpsonSimulator(seed=7)
    with serve_tcp(simulated, clock=ScaledClock(10.0)) as host:
        yield simulated, host.url


@pytest.fixture
def console(windows: WindowsPython, simulator, state, tmp_path: Path) -> Console:
    """``change --plain`` on Windows, at the simulator."""
    _, url = simulator
    (tmp_path / "robolink.toml").write_text(CELL.format(url=url))
    (tmp_path / "needle.toml").write_bytes(RECIPE.read_bytes())
    arguments = ("-m", "robolink_cli", "-c", "line3", "change", "needle.toml", "--plain")
    return Console(
        windows.command(*arguments), windows.environment({**state, "TERM": "xterm"}), tmp_path
    )


def test_a_person_types_steps_is_refused_an_unjogged_touch_and_stops(console, simulator):
    simulated, _ = simulator
    console.wait_for("Type the number of a row")
    console.type("1")
    console.type("3")
    console.wait_for("No row is open.")
    console.type("y")
    console.wait_for("Scan the id of the new needle.")
    console.type("N-0418")
    console.wait_for("Touch 1 of 2.")
    console.wait_for("take, stop, or help.")
    console.type("take")
    console.wait_for("Not yet: the tip still stands where the robot put it.")
    console.type("z-0.1")
    console.wait_for("Z -80.1")
    console.type("stop")
    console.wait_for("STOPPED")
    assert console.exit_code() == 9
    assert simulated.machine.flash_writes == 0
