"""A cell whose running program calls back: a simulated controller and a real server on a socket.

Each question is passed on, and simulated time goes on only after its answer, so no wall clock
decides anything. In a run that is cut short, this process answers the questions itself.
"""

import math
import random
from pathlib import Path

from robolink_simulators.cell.workplace import exchanged
from robolink_simulators.cell.world_parameters import WorldParameters
from robolink_simulators.epson import EpsonSimulator
from robolink_simulators.epson.memory.points import Point
from robolink_simulators.testkit.program_calls import AnsweredAt, AnsweredHere, ProgramCalls

from robolink.journal import memory_journal
from robolink.model import EntryKind, Pose, ToolOffset, new_operation
from robolink.serving import CallbackConversation, CallbackLimits, CallbackServer

COMPANION = Path(__file__).parents[2] / "companions" / "epson" / "recal.prg"
SERIAL = "SIM00001"
IDENTITY = f"epson:{SERIAL}"
CONTACT = 8
NS = 1_000_000_000
LIMITS = CallbackLimits(tolerance_mm=0.1, max_change_mm=2.0, sigma_mm=0.01)
MEASURED = (-60, -20, 20, 60, 90)
PROVED = (75, -75)
_MAIN = """
Global Integer ended
Function main
  ended = 0
  RobolinkRestore
  Tool 1
  If RobolinkOpen("127.0.0.1", 5001) Then
    If RobolinkBegin(1, "{method}") Then
      If {measure} Then
        If RobolinkWrite() Then
          If {prove} Then
            If RobolinkFinish() Then
              Print "kept"
            EndIf
          EndIf
        EndIf
      EndIf
    EndIf
  EndIf
  RobolinkClose
  Print rl_code$
  ended = 1
Fend
Function main2
  RobolinkRestore
Fend
"""
_TOUCHING = f"""
Function TouchAll(first As Integer, last As Integer) As Boolean
  Integer i
  TouchAll = True
  For i = first To last
    Tool 0
    Go P(i) +Z(3)
    RobolinkApproach({CONTACT})
    Go P(i)
    If TouchAll Then
      TouchAll = RobolinkTouch({CONTACT})
    EndIf
    Go P(i) +Z(3)
    Tool 1
  Next i
Fend
"""


def main_of(method, measure, prove, functions):
    """Return a program that calibrates by a method, with its functions to measure and test."""
    return _MAIN.format(method=method, measure=measure, prove=prove) + functions


def touching(method="n-angle", measured=MEASURED, proved=PROVED):
    """Return a program that touches a pin in this many orientations."""
    ends = f"TouchAll(11, {10 + len(measured)})", f"TouchAll(21, {20 + len(proved)})"
    return main_of(method, *ends, _TOUCHING)


MAIN = touching()
NOMINAL = ToolOffset(12, -3.5, -20)


class PowerCut(BaseException):
    """The controller loses its power at this moment."""


class CallbackCell:
    """Controller, program, server and journal, and the traffic between program and server.

    Args:
        folder: The folder for the program.
        seed: The seed of the world.
        journal: The server's journal, its own by default.
        limits: The server's limits.
        main: The program; that of the class by default.
        controllers: Recorded names given to the server.
        in_process: Whether a server without a thread answers.
        options: The controller's habits.
    """

    main = MAIN
    robot = "T6-602S"

    def __init__(
        self,
        folder,
        *,
        seed=1,
        journal=None,
        limits=LIMITS,
        main="",
        controllers=(),
        in_process=False,
        options=None,
    ):
        self.controllers = controllers
        self.rng = random.Random(f"callback {seed}")
        self.journal = journal or memory_journal(new_operation())
        self.limits = limits
        self.server: CallbackServer | None = None if in_process else self._serve()
        self.address = None if self.server is None else self.server.address
        self.calls = ProgramCalls(self._far_end)
        world = WorldParameters(contact_input=CONTACT)
        self.simulator = EpsonSimulator(
            self.robot, serial=SERIAL, seed=seed, world=world, options=options
        )
        path = Path(folder) / "main.prg"
        path.write_text(main or self.main, encoding="ascii")
        self.runner = self.simulator.load([COMPANION, path])
        self.runner.ports.dial = self.calls.dial
        self.furnish()

    def furnish(self):
        """Add the program's means of measurement other than the pin to the cell."""

    def _far_end(self):
        if self.address is None:
            return AnsweredHere(self.conversation("the program"))
        return AnsweredAt(self.address)

    def conversation(self, peer):
        """Return a conversation with one program."""
        return CallbackConversation(
            self.journal, self.limits, peer=peer, controllers=self.controllers
        )

    def _serve(self):
        server = CallbackServer("127.0.0.1", 0, self.conversation)
        server.start()
        return server

    def restart_server(self):
        """Stop the server, and start another on another port with the same journal."""
        assert self.server is not None
        self.server.close()
        self.server = self._serve()
        self.address = self.server.address

    @property
    def tool(self):
        return self.simulator.machine.tools.defined()[1]

    @property
    def error_mm(self):
        """The distance of the stored tip from the true one, in the plane."""
        true = self.simulator.world.tips[1]
        return math.hypot(true.x_mm - self.tool.x_mm, true.y_mm - self.tool.y_mm)

    def teach(self, first, angles, *, off_mm=0.0, noise_mm=0.003):
        """Teach points with the true tip on the pin, as the program's own search finds them."""
        true, pin = self.simulator.world.tips[1], self.simulator.world.pin_mm
        for number, u_deg in enumerate(angles, start=first):
            u_deg += self.rng.uniform(-2, 2)
            c, s = math.cos(math.radians(u_deg)), math.sin(math.radians(u_deg))
            pose = Pose(
                x_mm=pin[0]
                + off_mm
                - (c * true.x_mm - s * true.y_mm)
                + self.rng.gauss(0, noise_mm),
                y_mm=pin[1] - (s * true.x_mm + c * true.y_mm) + self.rng.gauss(0, noise_mm),
                z_mm=pin[2] - true.z_mm - 0.01,
                u_deg=u_deg,
                hand=self.simulator.machine.arm.flange().hand,
            )
            self.simulator.machine.points.store(number, Point.at(pose))

    def change_needle(self):
        """Mount another needle, whose tip is some tenths of a mm from the nominal one."""
        self.simulator.world.tips[1] = exchanged(NOMINAL, self.rng)
        self.bring()

    def bring(self):
        """Move the program's points to where the mounted needle needs them."""
        self.teach(11, MEASURED)
        self.teach(21, PROVED)

    def run(self, most_s=600.0):
        """Start production and run the program to its end; return its output."""
        self.start()
        return self.go_on(most_s)

    def start(self):
        """Start production."""
        self.runner.console.clear()
        self.simulator.panel.start_production()

    def go_on(self, most_s=600.0):
        """Run the program to its end; return its output."""
        end_ns = self.simulator.now_ns + round(most_s * NS)
        while self.runner.tasks:
            change = self.simulator.next_change()
            assert change is not None, "the program hangs"
            assert change < end_ns, "the program hangs"
            self.simulator.advance(change)
        assert self.runner.failure is None, self.runner.failure
        return "".join(self.runner.console).split()

    def lose_power(self):
        """Switch the controller off and on."""
        self.runner.on_statement = None
        self.simulator.restart()
        self.simulator.machine.switch_all_motors(True)

    def run_until(self, cut_at):
        """Start production and cut the power before a statement, by its number from 0.

        Returns:
            The statement, ``None`` if the program ended before.
        """
        at, reached = 0, None

        def count(_task, file, line, text):
            nonlocal at, reached
            if at == cut_at:
                reached = (file, line, text)
                raise PowerCut
            at += 1

        self.runner.on_statement = count
        try:
            self.run()
        except PowerCut:
            self.lose_power()
        self.runner.on_statement = None
        return reached

    def statements(self):
        """Run the program once; return its statements in order."""
        found = []
        self.runner.on_statement = lambda _t, file, line, text: found.append((file, line, text))
        self.run()
        self.runner.on_statement = None
        return found

    def restore(self):
        """Run the program that restores the old value, and nothing else."""
        self.runner.start("main2", self.simulator.now_ns)
        self.go_on()

    def entries(self, kind=None, *, limit=None):
        """Return the journal entries, newest first."""
        kinds = () if kind is None else (kind,)
        return list(self.journal.entries(controller=IDENTITY, kinds=kinds, limit=limit))

    def require_whole(self, old):
        """Check that the tool is unchanged, or tested and right; return which."""
        if self.tool.rounded(3) == old.rounded(3):
            return False
        (newest,) = self.entries(EntryKind.VERIFY, limit=1)
        assert list(newest.details["requested"]) == list(self.tool.rounded(3).components())
        assert self.error_mm < 0.03
        return True

    def open_markers(self):
        return [marker for _, marker in self.journal.open_markers()]

    def close(self):
        self.calls.cut()
        if self.server is not None:
            self.server.close()
