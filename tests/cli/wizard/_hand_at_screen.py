"""A simulated hand at the keys of a full screen that reads the screen, however it is drawn."""

import re
import time
from abc import ABC, abstractmethod

import pyte


class HandAtScreen(ABC):
    """Reads a screen, presses keys and brings the tip of a simulated robot onto its pin.

    Subclasses say how to read what was drawn (``read``) and how to press a key (``send``).

    Args:
        screen: The screen's content.
        eyes: The view of the tip, ``None`` if none is moved.
        tool: The tool of that tip.
    """

    longest_s = 30.0
    pause_s = 0.12

    def __init__(self, screen, eyes=None, tool=1):
        self.screen = screen
        self.stream = pyte.ByteStream(screen)
        self.keys, self.tool, self.eyes = 0, tool, eyes

    @abstractmethod
    def read(self, seconds=0.05):
        """Read new output; return whether the far end is still there."""

    @abstractmethod
    def send(self, key):
        """Press one key."""

    @property
    def text(self):
        return "\n".join(self.screen.display)

    def see(self, pattern):
        """Wait until a text is on the screen."""
        end_s = time.monotonic() + self.longest_s
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
            self.send(key)
            self.rest(self.pause_s)

    def start(self):
        """Confirm the questions of the check list, and start."""
        self.see(r"Start moving \(2 open\)")
        self.rest(0.4)
        self.press(["2", "5"])
        self.see(r"Start moving \(1 open\)")
        self.press(["2", "5"])
        self.see(r"Start moving(?! \()")
        self.press(["2", "5"])

    def left_mm(self):
        assert self.eyes is not None
        seen = self.eyes.look(self.tool)
        return seen.dx_mm, seen.dy_mm, seen.dz_mm

    def jog(self):
        """Jog the tip onto the pin: hold keys, with smaller and smaller steps."""
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
        """Hold one key until less than a step is left; it counts as one key."""
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
            end_s = time.monotonic() + self.longest_s / 10
            while self.left_mm()[axis] == before and time.monotonic() < end_s:
                self.rest(0.03)
            self.rest(0.15)
        raise AssertionError(f"the tip does not come nearer by {plus} and {minus}\n{self.text}")

    def touch(self):
        self.see("Jog the tip onto the pin")
        self.jog()
        self.press(["5"])

    def prove(self):
        """Make the two touches of the turn test."""
        for _ in range(2):
            self.see("Turn test")
            self.touch()
            self.see("moving|DONE")

    def write_and_prove(self):
        """Write the tool's proposal and make the turn test."""
        self.see("To write, type the tool number")
        self.rest(0.4)
        self.press([str(self.tool), "*"])
        self.prove()
