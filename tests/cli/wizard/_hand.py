"""A simulated hand at a pseudo terminal: sees the simulated tip and types the remaining steps."""

import time

from robolink_simulators.control.assist import InProcessEyes

FINE_MM = 0.07
"""The distance left for the last step, which must be a fine one."""


class LineHand:
    """Answers the dialogue of lines.

    Args:
        terminal: The pseudo terminal.
        simulator: The simulator whose tip it sees.
        tool: The tool of that tip.
    """

    def __init__(self, terminal, simulator, tool=1):
        self.terminal, self.tool = terminal, tool
        self.eyes = InProcessEyes(simulator)
        self.keys = 0

    def type(self, text):
        self.keys += len(text) + 1
        self.terminal.press(text.encode() + b"\n")

    def start(self):
        self.terminal.wait_for("then y to start; n = leave")
        for key in ("1", "2"):
            self.type(key)
            self.terminal.wait_for(r"First: 2\.|are confirmed")
        self.type("y")

    def left_mm(self):
        seen = self.eyes.look(self.tool)
        return seen.dx_mm, seen.dy_mm, seen.dz_mm

    def bring(self):
        """Jog the tip onto the pin, and wait as long as a person would look."""
        self.terminal.wait_for(r"stop, or help\.")
        time.sleep(0.35)
        self.jog()
        time.sleep(0.35)

    def jog(self):
        while max(map(abs, left := self.left_mm())) >= 0.02:
            far = max(map(abs, left)) > 0.1
            ways = (left[0], left[1], left[2] + (FINE_MM if far else 0.0))
            steps = [(axis, max(-4.9, min(4.9, by))) for axis, by in zip("xyz", ways, strict=True)]
            self.type(" ".join(f"{axis}{by:+.3f}" for axis, by in steps if abs(by) > 0.004))
            self.terminal.wait_for(r"(Flange|Tip) X[^\n]*\n")
        time.sleep(0.35)

    def touch(self):
        self.bring()
        self.type("take")
