"""A machine with a PLC whose own program touches a pin, and gives its permit by the contact."""

import math
import random

from robolink_simulators.softmotion.mailbox import SoftMotionSimulator

from robolink.protocols.mailbox import from_frame

TURNS = (0.0, -120.0, -60.0, -150.0, -90.0)
PROVING = (-30.0, -135.0)
OFF_LOOKS, HELD_LOOKS = 5, 6
"""For so many looks of the client the tip is clear, and held at the pin."""


class PermitMachine:
    """The machine's program, one step at each look of the client.

    It touches, waits for ``xToolChanged``, proves, and waits until the mailbox is given back.

    Attributes:
        state: What it is at: ``touches``, ``waits``, ``proves``, ``blocked``, ``produces`` or
            ``gave up``.
        miss: Numbers of touches, counted from 0, that go beside the pin.
        leaves: Whether it takes its permit away in the middle of the proof.
        bump_mm: How far the pin is bumped before the proof.
    """

    def __init__(self, simulator: SoftMotionSimulator, *, seed=1, noise_mm=0.003):
        self.simulator, self.panel = simulator, simulator.panel
        self.rng, self.noise_mm = random.Random(f"machine {seed}"), noise_mm
        x, y, z = simulator.world.pin_mm
        simulator.world.pin_mm = (0.8 * x, 0.8 * y, z)  # where all angles of U are reached
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
        """What slot 1 holds, X and Y in mm."""
        return from_frame(self.simulator.plc.memory.slot(1).tool, unit_um=1000.0)[:2]

    @property
    def error_mm(self):
        """How far that is from the true tip."""
        true = self.simulator.world.tips[1]
        return math.dist(self.stored, (true.x_mm, true.y_mm))

    def look(self):
        """Do one step."""
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
        """Bring the tip onto the pin at an angle, as its own search does."""
        with self.simulator.lock:
            world = self.simulator.world
            here = world.robot.flange().u_deg
            world.robot.turn(self.start_u + u_deg + self.rng.uniform(-2, 2) - here)
            x, y, z = (gap + self.rng.gauss(0, self.noise_mm) for gap in world.gap_mm())
            world.robot.carry(world.tips[1], (x, y, z))

    def _waits(self):
        """The value is awaited, with the tip at its last touch."""
        self.waited_looks += 1
        if self.panel.tool_changed:
            self.state, self.looks = "proves", 0
            x, y, z = self.simulator.world.pin_mm
            self.simulator.world.pin_mm = (x + self.bump_mm, y, z)
        elif self.waited_looks > 40:
            self.panel.withdraw_permit()
            self.state = "gave up"

    def restart(self):
        """Start the PLC, and with it this program, which then has seen nobody own the mailbox."""
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
