"""A machine whose PLC program touches a pin itself and reports each touch by the contact input."""

import math
import random

from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.protocols.mailbox import from_frame

TURNS = (0.0, -120.0, -60.0, -150.0, -90.0)
PROVING = (-30.0, -135.0)
OFF_LOOKS, HELD_LOOKS = 5, 6
"""Number of client polls for which the tip is clear of the pin, and for which it stays on it."""


class PermitMachine:
    """The machine's program; runs one step each time the client polls.

    It touches, waits for ``xToolChanged``, runs the turn test, and waits until the mailbox is free.

    Attributes:
        state: The current step: ``touches``, ``waits``, ``proves``, ``blocked``, ``produces`` or
            ``gave up``.
        miss: Numbers of the touches, counted from 0, that miss the pin.
        leaves: Whether the program withdraws its permit during the turn test.
        bump_mm: How far the pin is bumped before the turn test.
    """

    def __init__(self, simulator: SoftMotionSimulator, *, seed=1, noise_mm=0.003):
        self.simulator, self.panel = simulator, simulator.panel
        self.rng, self.noise_mm = random.Random(f"machine {seed}"), noise_mm
        x, y, z = simulator.world.pin_mm
        simulator.world.pin_mm = (0.8 * x, 0.8 * y, z)  # all angles of U can be reached there
        self.start_u = simulator.world.robot.flange().u_deg
        self.miss: set[int] = set()
        self.leaves = False
        self.waited_looks = 0
        self.bump_mm = 0.0
        self.owned = self.given_back = False
        self.begin()

    def begin(self, turns=TURNS, proving=PROVING):
        """Begin a calibration."""
        self.turns, self.state, self.number, self.looks = (*turns, *proving), "touches", 0, 0
        self.measured = len(turns)
        self.panel.withdraw_permit()

    @property
    def stored(self):
        """The X and Y of slot 1, mm."""
        return from_frame(self.simulator.plc.memory.slot(1).tool, unit_um=1000.0)[:2]

    @property
    def error_mm(self):
        """The distance of the stored value from the true tip."""
        true = self.simulator.world.tips[1]
        return math.dist(self.stored, (true.x_mm, true.y_mm))

    def look(self):
        """Run one step."""
        self.looks += 1
        owned = self.panel.owned
        self.given_back, self.owned = self.owned and not owned, owned
        getattr(self, f"_{self.state.replace(' ', '_')}")()

    def _touches(self):
        self._touch_at(self.measured, "waits")

    def _proves(self):
        if self.leaves:
            self.panel.withdraw_permit()
            self.state = "blocked"
            return
        self._touch_at(len(self.turns), "blocked")

    def _touch_at(self, end, then):
        phase = self.looks % (OFF_LOOKS + HELD_LOOKS)
        if phase == 1:
            self.panel.withdraw_permit()
            self._bring(self.turns[self.number])
        elif phase == OFF_LOOKS:
            if self.number not in self.miss:
                self.panel.give_permit()
            self.number += 1
            if self.number == end:
                self.state, self.waited_looks = then, 0

    def _bring(self, u_deg):
        """Move the tip onto the pin at an angle, as the machine's own search does."""
        with self.simulator.lock:
            world = self.simulator.world
            here = world.robot.flange().u_deg
            world.robot.turn(self.start_u + u_deg + self.rng.uniform(-2, 2) - here)
            x, y, z = (gap + self.rng.gauss(0, self.noise_mm) for gap in world.gap_mm())
            world.robot.carry(world.tips[1], (x, y, z))

    def _waits(self):
        """Wait for ``xToolChanged`` with the tip at its last touch; give up after 40 polls."""
        self.waited_looks += 1
        if self.panel.tool_changed:
            self.state, self.looks = "proves", 0
            x, y, z = self.simulator.world.pin_mm
            self.simulator.world.pin_mm = (x + self.bump_mm, y, z)
        elif self.waited_looks > 40:
            self.panel.withdraw_permit()
            self.state = "gave up"

    def restart(self):
        """Restart the PLC and this program, which then has not yet seen an owner of the mailbox."""
        self.panel.restart()
        self.owned = False

    def _blocked(self):
        if self.given_back:
            self.panel.take_change_back()
            self.panel.withdraw_permit()
            self.state = "produces"

    def _produces(self):
        pass

    _gave_up = _produces
