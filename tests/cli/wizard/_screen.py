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
from robolink_simulators.assist.port import InProcessEyes

LONGEST_S = 30.0


class ScreenHand:
    """The far end of a pseudo terminal, drawn by pyte; and a hand at its keys.

    Args:
        words: The command line.
        simulator: Whose tip the hand looks at.
        tool: Which tip.
    """

    def __init__(self, words, simulator=None, tool=1, *, columns=80, rows=24):
        self.screen = pyte.Screen(columns, rows)
        self.stream = pyte.ByteStream(self.screen)
        self.last = ""
        self.raw, self.keys, self.tool, self.host = b"", 0, tool, None
        self.eyes = InProcessEyes(simulator) if simulator is not None else None
        self.master, near = pty.openpty()
        self.size(columns, rows)
        self.before = termios.tcgetattr(near)
        paths = os.pathsep.join(path for path in sys.path if path)
        environment = {**os.environ, "PYTHONPATH": paths, "TERM": "xterm-256color"}
        for name in ("COLUMNS", "LINES", "ROBOLINK_PLAIN"):
            environment.pop(name, None)
        self.command = subprocess.Popen(
            [
                sys.executable,
                "-c",
                "import fcntl, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0); "
                "from robolink_cli.main import main; main()",
                *words,
            ],
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

    @property
    def text(self):
        return "\n".join(self.screen.display)

    def read(self, seconds=0.05):
        """Take what was drawn; return whether the far end is still there."""
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

    def see(self, pattern):
        """Wait until something is seen on the screen."""
        end_s = time.monotonic() + LONGEST_S
        while not (found := re.search(pattern, self.text)):
            assert self.read(), f"it ended before {pattern!r}\n{self.text}"
            assert time.monotonic() < end_s, f"{pattern!r} is not in\n{self.text}"
        return found

    def rest(self, seconds):
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0:
            self.read(left_s)

    def press(self, keys, *, count=True):
        """Press keys one by one, as a hand does."""
        for key in keys:
            self.keys += count
            os.write(self.master, key.encode() if isinstance(key, str) else key)
            self.rest(0.12)

    def end(self):
        """Leave the last screen, where there is one, and return the exit code."""
        end_s, shown = time.monotonic() + LONGEST_S, ""
        while self.read(0.2) and time.monotonic() < end_s:
            if re.search(r"(DONE|STOPPED) *(SIMULATED *)?$", self.screen.display[0]) and not shown:
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

    def start(self):
        """Confirm what the list asks, and start."""
        self.see(r"Start moving \(2 open\)")
        self.rest(0.4)
        self.press(["1", "3", "5"])

    def left_mm(self):
        assert self.eyes is not None
        seen = self.eyes.look(self.tool)
        return seen.dx_mm, seen.dy_mm, seen.dz_mm

    def jog(self):
        """Bring the tip onto the pin: hold keys in sizes that get smaller."""
        self.rest(0.45)
        for size in (1.0, 0.1, 0.01):
            self._size(size)
            for axis, plus, minus in ((0, "6", "4"), (1, "8", "2"), (2, "9", "3")):
                self._hold(axis, plus, minus, size)
        self.rest(0.45)

    def _size(self, size):
        for _ in range(9):
            now = float(self.see(r"Step +([\d.]+) mm")[1])
            if abs(now - size) < 1e-9:
                return
            self.press(["+" if now < size else "-"])

    def _hold(self, axis, plus, minus, size):
        """Hold one key until what is left is less than a step; it counts as one."""
        held = False
        for _ in range(60):
            left = self.left_mm()[axis]
            if size == 1.0 and axis == 2:
                left = left + 0.3 if left < 0 else left
            steps = int(abs(left) / size + (0.3 if size < 0.1 else 0.0))
            if steps < 1:
                return
            self.keys += not held
            held = True
            before = self.left_mm()[axis]
            self.press([plus if left > 0 else minus], count=False)
            end_s = time.monotonic() + 3.0
            while self.left_mm()[axis] == before and time.monotonic() < end_s:
                self.rest(0.03)
            self.rest(0.15)

    def touch(self):
        self.see("Jog the tip onto the pin")
        self.jog()
        self.press(["5"])
