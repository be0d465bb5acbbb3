"""A terminal of 80 by 24 on which the real command draws, as a person sees it."""

import os
import pty
import re
import select
import struct
import subprocess
import sys
import termios
import time

import pyte
from robolink_simulators.control.assist import InProcessEyes

from tests.cli.wizard._hand_at_screen import HandAtScreen

_THE_END = re.compile(r"(DONE|STOPPED|NOT STARTED) *(SIMULATED *)?$")


class ScreenHand(HandAtScreen):
    """The far end of a pseudo terminal, drawn by pyte, with a simulated hand at its keys.

    Args:
        words: The command line.
        simulator: The simulator whose tip the hand sees.
        tool: The tool of that tip.
    """

    def __init__(self, words, simulator=None, tool=1, *, columns=80, rows=24):
        eyes = InProcessEyes(simulator) if simulator is not None else None
        super().__init__(pyte.Screen(columns, rows), eyes, tool)
        self.last, self.raw, self.host = "", b"", None
        self.master, near = pty.openpty()
        self.size(columns, rows)
        self.before = termios.tcgetattr(near)
        paths = os.pathsep.join(path for path in sys.path if path)
        environment = {**os.environ, "PYTHONPATH": paths, "TERM": "xterm-256color"}
        for name in ("COLUMNS", "LINES", "ROBOLINK_PLAIN"):
            environment.pop(name, None)
        self.command = subprocess.Popen(
            [sys.executable, "-m", "tests.contract._own_window", *words],
            stdin=near,
            stdout=near,
            stderr=near,
            env=environment,
            start_new_session=True,
        )
        os.close(near)

    def size(self, columns, rows):
        import fcntl

        fcntl.ioctl(self.master, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))

    def read(self, seconds=0.05):
        """Read new output; return whether the far end is still there."""
        ready, _, _ = select.select([self.master], [], [], seconds)
        if not ready:
            return True
        try:
            data = os.read(self.master, 65536)
        except OSError:
            return False
        self.raw += data
        self.stream.feed(data)
        return bool(data)

    def send(self, key):
        """Press one key."""
        os.write(self.master, key.encode() if isinstance(key, str) else key)

    def end(self):
        """Leave the last screen, if there is one, and return the exit code."""
        end_s, shown = time.monotonic() + self.longest_s, ""
        while self.read(0.2) and time.monotonic() < end_s:
            if (
                re.search(r"(DONE|STOPPED|NOT STARTED) *(SIMULATED *)?$", self.screen.display[0])
                and not shown
            ):
                self.rest(0.5)
                shown = self.last = self.text
                self.press(["0"])
        return self.command.wait(5.0)

    def close(self):
        if self.command.poll() is None:
            self.command.kill()
            self.command.wait()
        if self.master >= 0:
            os.close(self.master)
            self.master = -1
